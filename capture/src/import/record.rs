//! Copying a source into a recording.

use std::fmt;

use serde::Serialize;

use super::number_list::number_list;
use crate::{CaptureError, Frame, Recorder, Rig, Source};

/// The result of an import: frames copied, and those that could not be.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct ImportReport {
    /// Frames in the recording.
    pub frames: u64,
    /// Device numbers of frames that have colour but no depth.
    pub without_depth: Vec<u64>,
    /// Device numbers of frames that have depth but no colour, where the sensor has colour.
    pub without_color: Vec<u64>,
    /// Device numbers of frames whose colour image is damaged or cut off; they are in the recording as they came.
    pub damaged_color: Vec<u64>,
    /// Frames that the device's numbers say are missing between those that are there.
    pub lost: u64,
    /// Frames that could not be read, each with the reason; they are not in the recording.
    pub unreadable: Vec<String>,
    /// Size of the recording, bytes.
    pub bytes: u64,
}

impl ImportReport {
    /// Counts a frame that was copied.
    fn count(&mut self, frame: &Frame, rig: &Rig) {
        self.frames += 1;
        if frame.depth.is_none() {
            self.without_depth.push(frame.device_frame);
        }
        let has_color_camera = rig.sensors.get(frame.sensor).is_some_and(|sensor| sensor.color.is_some());
        if frame.color.is_none() && has_color_camera {
            self.without_color.push(frame.device_frame);
        }
        if frame.color.as_ref().is_some_and(|color| color.check().is_err()) {
            self.damaged_color.push(frame.device_frame);
        }
    }

    /// True where nothing is missing.
    pub fn is_complete(&self) -> bool {
        let whole = [&self.without_depth, &self.without_color, &self.damaged_color];
        whole.iter().all(|numbers| numbers.is_empty()) && self.lost == 0 && self.unreadable.is_empty()
    }

    /// True where data that was in the source is not in the recording.
    pub fn lost_data(&self) -> bool {
        !self.unreadable.is_empty() || !self.damaged_color.is_empty()
    }
}

impl fmt::Display for ImportReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} frames", self.frames)?;
        let lists = [
            (&self.without_depth, "without depth"),
            (&self.without_color, "without colour"),
            (&self.damaged_color, "with a damaged colour image"),
        ];
        for (numbers, what) in lists {
            if !numbers.is_empty() {
                write!(f, "; {} {what}: {}", numbers.len(), number_list(numbers))?;
            }
        }
        if self.lost > 0 {
            write!(f, "; {} missing by the frame numbers", self.lost)?;
        }
        if let Some(first) = self.unreadable.first() {
            write!(f, "; {} not readable, the first: {first}", self.unreadable.len())?;
        }
        Ok(())
    }
}

/// Copies all frames of `source` into `recorder` and finishes it. Frames that cannot be read are left out and reported;
/// the next frame then counts them as lost. `progress` is called with 0..1 where the source knows its length.
///
/// # Errors
/// [`CaptureError`] where the recording cannot be written or not one frame can be read (then with the first reason).
pub fn record(
    source: &mut dyn Source,
    mut recorder: Recorder,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<ImportReport, CaptureError> {
    let total = source.frame_count().unwrap_or(0).max(1);
    let mut report = ImportReport::default();
    let mut first_error = None;
    let mut skipped = 0;
    for done in 0_u64.. {
        match source.next_frame() {
            Ok(None) => break,
            Ok(Some(mut frame)) => {
                report.lost += u64::from(frame.lost_before);
                frame.lost_before = frame.lost_before.saturating_add(std::mem::take(&mut skipped));
                recorder.write(&frame)?;
                report.count(&frame, recorder.rig());
            }
            Err(error @ CaptureError::Device { .. }) => return Err(error),
            Err(error) => {
                skipped += 1;
                report.unreadable.push(error.to_string());
                first_error.get_or_insert(error);
            }
        }
        progress((done + 1).min(total) as f32 / total as f32);
    }
    match first_error {
        Some(error) if report.frames == 0 => Err(error),
        _ => {
            report.bytes = recorder.finish()?.bytes;
            Ok(report)
        }
    }
}
