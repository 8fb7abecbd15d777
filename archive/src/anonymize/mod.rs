//! A copy of a subject in which nobody is recognised: no colour, a smooth head, another name.

mod about;
mod head;

use std::{
    fs,
    path::{Path, PathBuf},
};

use serde::Serialize;
use toile_capture::{Frame, Recorder, RecorderOptions, Replay, Rig, Sensor, Source, Subject, SubjectLock, trajectory};
use toile_pipeline::{Folders, read_mesh};

use crate::ArchiveError;
use head::Head;

/// What was made.
#[derive(Debug, Clone, Serialize)]
pub struct Anonymized {
    /// The new subject's folder.
    pub to: PathBuf,
    /// Takes in it.
    pub takes: usize,
    /// Frames whose head was smoothed.
    pub frames: u64,
    /// Frames that were left out, since nobody knows where the head is in them.
    pub left_out: u64,
}

/// Writes a copy of the processed subject at `root` to the new folder `to`, called `name`: takes without colour and with the surface of the
/// head smoothed until no face is left, no results, no notes, no date. What was done stands in its `subject.toml`.
///
/// # Errors
/// [`ArchiveError`] where the subject was not processed, a take cannot be made anonymous (a finished scan, several sensors), or
/// `to` exists. Nothing is left then.
pub fn anonymize(root: &Path, to: &Path, name: &str) -> Result<Anonymized, ArchiveError> {
    let subject = Subject::open(root)?;
    let _lock = SubjectLock::acquire(root)?;
    if to.exists() {
        return Err(ArchiveError::refused(to, "exists already; give a new folder"));
    }
    let mut done = Anonymized { to: to.to_path_buf(), takes: 0, frames: 0, left_out: 0 };
    let result = subject.layers().iter().try_for_each(|layer| {
        let label = layer.label();
        done.takes += 1;
        take(root, &label, &to.join("takes").join(format!("{label}.mcap")), &mut done)
    });
    let result = result.and_then(|()| about::write(&subject, to, name));
    if result.is_err() {
        // A new folder: nobody else has anything in it.
        drop(fs::remove_dir_all(to));
    }
    result.map(|()| done)
}

/// One take, frame by frame.
fn take(root: &Path, label: &str, to: &Path, done: &mut Anonymized) -> Result<(), ArchiveError> {
    let folders = Folders::new(root);
    let from = folders.take(label);
    let refused = |reason: &str| Err(ArchiveError::refused(&from, reason));
    if folders.scan_take(label).is_some() {
        return refused("is a finished scan; only recordings can be made anonymous");
    }
    let (scan, way) = (folders.scan(label), folders.trajectory(label));
    if !scan.is_file() || !way.is_file() {
        return refused("was not fused, so that nobody knows where the head is; run `toile process` first");
    }
    let mut replay = Replay::open(&from)?;
    let [sensor] = &replay.rig().sensors[..] else {
        return refused("has several sensors; only takes of one can be made anonymous yet");
    };
    let head = Head::of(&read_mesh(&scan)?, trajectory::read(&way)?, sensor);
    let Some(head) = head else { return refused("its scan is empty") };
    let sensor = Sensor { color: None, ..sensor.clone() };
    let rig = Rig { sensors: vec![sensor] };
    let mut recorder =
        Recorder::create(to, &rig, RecorderOptions { replace_part: true, ..RecorderOptions::default() })?;
    while let Some(frame) = replay.next_frame()? {
        let Some(depth) = frame.depth.as_ref().and_then(|depth| head.smooth(depth, frame.device_time_ns)) else {
            done.left_out += 1;
            continue;
        };
        recorder.write(&Frame { depth: Some(depth.into()), color: None, ..frame })?;
        done.frames += 1;
    }
    recorder.finish()?;
    Ok(())
}
