//! A copy of a subject in which nobody is recognised: no colour, a smooth head in place of the person's, no names of people or
//! devices.

mod about;
mod head;
mod smooth_head;

use std::{
    fs,
    path::{Path, PathBuf},
};

use serde::Serialize;
use toile_capture::{
    DeviceIdentity, Frame, Recorder, RecorderOptions, Replay, Rig, Sensor, Source, Subject, SubjectLock, trajectory,
};
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
    /// Frames whose head was replaced.
    pub frames: u64,
    /// Frames that were left out, since nobody knows where the head is in them.
    pub left_out: u64,
}

/// Writes a copy of the processed subject at `root` to the new folder `to`, called `name`: takes without colour, with a smooth
/// head in place of the person's and without the device's serial number, no results, no notes, no date. What was done stands in its `subject.toml`.
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
    // Serial number and firmware tell which device it was, and so where and when.
    let identity = DeviceIdentity { serial: String::new(), firmware: String::new(), ..sensor.identity.clone() };
    let sensor = Sensor { color: None, identity, ..sensor.clone() };
    let rig = Rig { sensors: vec![sensor] };
    let mut recorder =
        Recorder::create(to, &rig, RecorderOptions { replace_part: true, ..RecorderOptions::default() })?;
    // Times begin with the take: those of a clock that knows the date would tell it.
    let mut begin = None;
    while let Some(frame) = replay.next_frame()? {
        let (device, host) = *begin.get_or_insert((frame.device_time_ns, frame.host_time_ns));
        let Some(depth) = frame.depth.as_ref().and_then(|depth| head.replace(depth, frame.device_time_ns)) else {
            done.left_out += 1;
            continue;
        };
        let (device_time_ns, host_time_ns) = (frame.device_time_ns - device, frame.host_time_ns - host);
        recorder.write(&Frame { depth: Some(depth.into()), color: None, device_time_ns, host_time_ns, ..frame })?;
        done.frames += 1;
    }
    recorder.finish()?;
    Ok(())
}
