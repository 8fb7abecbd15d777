//! Takes that were recorded and not accepted: kept, but not as the subject's.

use std::{
    fs::{self, File},
    path::{Path, PathBuf},
};

use toile_capture::{CaptureError, Layer};

/// Moves a finished recording to `takes/rejected/`, under the next free number; gives where it is kept.
///
/// # Errors
/// [`CaptureError`] where it cannot be moved.
pub fn put_aside(recording: &Path, layer: &Layer) -> Result<PathBuf, CaptureError> {
    let folder = recording.parent().unwrap_or(Path::new(".")).join("rejected");
    fs::create_dir_all(&folder).map_err(|error| CaptureError::io(&folder, error))?;
    let name = |n: u32| folder.join(format!("{}.{n}.mcap", layer.label()));
    let free = (1_u32..).map(name).find(|path| fs::symlink_metadata(path).is_err());
    let free = free.ok_or_else(|| CaptureError::format(&folder, "there is no free name left"))?;
    fs::rename(recording, &free).map_err(|error| CaptureError::io(recording, error))?;
    // Where a folder cannot be synced the move is as durable as the file system makes it.
    drop(File::open(&folder).and_then(|folder| folder.sync_all()));
    Ok(free)
}
