//! What a whole run leaves behind, so that planning need not read takes: `build/timings.json`.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    os::unix::fs::MetadataExt,
    path::Path,
};

use serde::{Deserialize, Serialize};
use toile_capture::files::atomic_write;

use crate::{
    PipelineError, Run,
    asked::Asked,
    folders::Folders,
    json, record,
    resume::{TIMINGS, read_timings},
};

/// Sizes and times of the files of a whole run, and what it was asked. It lies in a file called `timings.json` because it differs
/// from run to run, as those do.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ticket {
    /// What decided the result beside the takes.
    pub asked: Asked,
    /// Bytes, and nanoseconds since 1970 of the last change, of every file that a step read or wrote, by its path in the
    /// subject's folder.
    pub files: BTreeMap<String, [u64; 2]>,
    /// Seconds of all steps, each as it ran last.
    pub seconds: f64,
    /// The most resident memory that a step needed when it ran last, bytes.
    pub peak_memory_bytes: Option<u64>,
}

impl Ticket {
    /// Of the last whole run over the subject at `root`; `None` where there was none, or its file is damaged.
    pub fn read(root: &Path) -> Option<Self> {
        json::read(&Folders::new(root).build().join(TIMINGS)).ok()
    }

    /// Writes the ticket of a run that has just ended.
    pub(crate) fn write(run: &Run) -> Result<(), PipelineError> {
        let folders = &run.folders;
        let asked = Asked::of(folders, &run.settings, run.layers.clone())?;
        let mut files = BTreeSet::new();
        let (mut seconds, mut peak) = (0.0, None);
        for folder in step_folders(folders) {
            files.extend(record::files_in(&folder).into_values().flatten());
            for times in read_timings(&folder).values() {
                seconds += times.get("seconds").and_then(serde_json::Value::as_f64).unwrap_or(0.0);
                peak = peak.max(times.get("peak_memory_bytes").and_then(serde_json::Value::as_u64));
            }
        }
        let files = files.into_iter().filter_map(|name| Some((stamp(&folders.root.join(&name))?, name)));
        let files = files.map(|(stamp, name)| (name, stamp)).collect();
        let ticket = Self { asked, files, seconds, peak_memory_bytes: peak };
        if Self::read(&folders.root).as_ref() == Some(&ticket) {
            return Ok(());
        }
        Ok(atomic_write(&folders.build().join(TIMINGS), &json::pretty(&ticket)?)?)
    }

    /// The files that are not as they were, and how; none where the whole subject was copied and all sizes agree.
    pub(crate) fn changed(&self, root: &Path) -> Vec<(&str, &'static str)> {
        let now: Vec<_> = self.files.iter().map(|(name, was)| (name.as_str(), *was, stamp(&root.join(name)))).collect();
        let times = || now.iter().filter_map(|(_, _, now)| now.map(|now| now[1]));
        // A copy gives every file a time of its own; they lie as close together as copying takes.
        let all_moved = now.iter().all(|(_, was, now)| now.is_none_or(|now| now[1] != was[1]));
        let spread = times().max().unwrap_or(0) - times().min().unwrap_or(0);
        let copied = all_moved && spread < COPY_NS;
        let change = |was: [u64; 2], now: Option<[u64; 2]>| match now {
            None => Some("is missing"),
            Some(now) if now[0] != was[0] => Some("has another size"),
            Some(now) if now[1] != was[1] && !copied => Some("was written anew"),
            Some(_) => None,
        };
        now.iter().filter_map(|(name, was, now)| Some((*name, change(*was, *now)?))).collect()
    }
}

/// How long copying a subject takes at most, nanoseconds: ten minutes, a gigabyte over a slow network.
const COPY_NS: u64 = 600_000_000_000;

/// The folders in `build/` in which steps left a record, in the order of their names.
pub(crate) fn step_folders(folders: &Folders) -> Vec<std::path::PathBuf> {
    let entries = fs::read_dir(folders.build()).into_iter().flatten().flatten();
    let mut found: Vec<_> = entries.map(|entry| entry.path()).filter(|path| path.is_dir()).collect();
    found.sort();
    found
}

/// Bytes and time of the last change of a file; `None` where there is none.
fn stamp(path: &Path) -> Option<[u64; 2]> {
    let found = fs::metadata(path).ok().filter(fs::Metadata::is_file)?;
    Some([found.size(), (found.mtime() * 1_000_000_000 + found.mtime_nsec()).max(0) as u64])
}
