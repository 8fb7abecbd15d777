//! A recording rewritten for other programs.

use std::path::Path;

use super::{
    options::{DepthEncoding, RecorderOptions, RecordingSummary},
    recorder::Recorder,
    replay::Replay,
};
use crate::{CaptureError, Source};

/// Rewrites the recording `path_in` as `path_out` with depth as `16UC1` images, which the field's viewers display.
///
/// # Errors
/// [`CaptureError`] where one cannot be read or the other cannot be written.
pub fn export_standard(path_in: &Path, path_out: &Path) -> Result<RecordingSummary, CaptureError> {
    let replay = Replay::open(path_in)?;
    let options = RecorderOptions { depth: DepthEncoding::Raw, replace_part: true, ..RecorderOptions::default() };
    let mut recorder = Recorder::create(path_out, replay.rig(), options)?;
    for index in 0..replay.len() {
        recorder.write(&replay.frame(index)?)?;
    }
    recorder.finish()
}
