//! A recording or importable folder as a source, with what is known to be missing from it.

use std::path::Path;

use toile_capture::{
    Replay, Source,
    import::{self, Format},
};

use crate::PipelineError;

/// A recording or folder, opened, and what is known to be missing from it.
pub struct Opened {
    /// Its frames.
    pub source: Box<dyn Source>,
    /// Losses of a torn or damaged recording, a sentence each.
    pub lost: Vec<String>,
    /// Frames that never arrived while recording.
    pub dropped: u64,
}

impl Opened {
    /// Opens a recording, or a folder in `format` (guessed where it is `None`).
    ///
    /// # Errors
    /// [`PipelineError`] that names the file or field that is missing or wrong.
    pub fn new(recording: &Path, format: Option<Format>) -> Result<Self, PipelineError> {
        let format = format.map_or_else(|| import::guess(recording), Ok)?;
        if format != Format::Mcap || !recording.is_file() {
            let source = import::open(recording, Some(format))?;
            return Ok(Self { lost: source.remarks(), source, dropped: 0 });
        }
        let replay = Replay::open(recording)?;
        let lost = replay.lost().map(|l| format!("{}: {l}", recording.display())).into_iter().collect();
        let dropped = (0..replay.len()).filter_map(|i| replay.info(i)).map(|f| u64::from(f.lost_before)).sum();
        Ok(Self { source: Box::new(replay), lost, dropped })
    }
}
