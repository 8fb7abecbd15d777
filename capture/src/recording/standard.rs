//! A recording rewritten for other programs.

use std::path::Path;

use super::{
    options::{DepthEncoding, RecorderOptions},
    recorder::Recorder,
    replay::Replay,
};
use crate::{
    CaptureError, Source,
    import::{self, ImportReport},
};

/// Rewrites the recording `path_in` as `path_out` with depth as `16UC1` images, which the field's viewers display. Frames
/// that cannot be read are left out and reported. Where it fails, no file is left.
///
/// # Errors
/// [`CaptureError`] where one cannot be read or the other cannot be written.
pub fn export_standard(path_in: &Path, path_out: &Path) -> Result<ImportReport, CaptureError> {
    let mut replay = Replay::open(path_in)?;
    let options = RecorderOptions { depth: DepthEncoding::Raw, replace_part: true, ..RecorderOptions::default() };
    let recorder = Recorder::create(path_out, replay.rig(), options)?;
    import::record(&mut replay, recorder, &|_| ())
}
