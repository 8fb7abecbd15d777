//! Opened recordings: finding the frames of a take reads the whole file, so what was found is kept while the file is the same.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
    time::SystemTime,
};

use toile_capture::{CaptureError, Replay};

/// Recordings that stay open.
const KEPT: usize = 16;

type Stamp = (u64, Option<SystemTime>);

/// Recordings by their path: when they were written, when they were last asked for, and what is in them.
type Known = BTreeMap<PathBuf, (Stamp, u64, Arc<Replay>)>;

/// The recordings that were looked at last.
#[derive(Default)]
pub struct Recordings(Mutex<Known>);

impl Recordings {
    /// The recording at `path`.
    ///
    /// # Errors
    /// As [`Replay::open`].
    pub fn open(&self, path: &Path) -> Result<Arc<Replay>, CaptureError> {
        let about = fs::metadata(path).map_err(|error| CaptureError::io(path, error))?;
        let stamp = (about.len(), about.modified().ok());
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let turn = 1 + kept.values().map(|entry| entry.1).max().unwrap_or(0);
        if let Some((_, used, replay)) = kept.get_mut(path).filter(|entry| entry.0 == stamp) {
            *used = turn;
            return Ok(replay.clone());
        }
        drop(kept);
        let replay = Arc::new(Replay::open(path)?);
        kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        kept.insert(path.to_path_buf(), (stamp, turn, replay.clone()));
        if kept.len() > KEPT {
            let oldest = kept.iter().min_by_key(|(_, entry)| entry.1).map(|(path, _)| path.clone());
            oldest.iter().for_each(|path| drop(kept.remove(path)));
        }
        Ok(replay)
    }
}
