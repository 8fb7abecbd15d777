//! A subject as recordings.

use std::path::Path;

use toile_capture::{Recorder, RecorderOptions, RecordingSummary};

use crate::{SyntheticError, take::Take};

/// Records every frame of a take into an MCAP file.
///
/// # Errors
/// [`SyntheticError`] names the frame or file at fault.
pub fn record_take(
    take: &Take,
    path: &Path,
    options: RecorderOptions,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<RecordingSummary, SyntheticError> {
    let mut recorder = Recorder::create(path, &take.rig(), options)?;
    for index in 0..take.moments.len() {
        recorder.write(&take.frame(index)?)?;
        progress((index + 1) as f32 / take.moments.len() as f32);
    }
    Ok(recorder.finish()?)
}
