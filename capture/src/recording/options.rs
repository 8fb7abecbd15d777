//! How to record, and what came of it.

use std::path::PathBuf;

/// How depth stands in the file; lossless either way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DepthEncoding {
    /// Packed by [`depth_codec`](super::depth_codec) in `toile.CompressedDepth` messages: small; other viewers do not
    /// show it.
    #[default]
    Packed,
    /// `foxglove.RawImage` with encoding `16UC1`: what the field's viewers display; about three times larger.
    Raw,
}

/// How to record.
#[derive(Debug, Clone, PartialEq)]
pub struct RecorderOptions {
    /// How depth stands in the file.
    pub depth: DepthEncoding,
    /// A chunk is closed and synced to the disk after the frame that brings it to this many bytes; a power cut loses
    /// one chunk at most. Default 4 MiB, less than half a second of a 640×480 sensor.
    pub chunk_bytes: usize,
    /// What is recorded can be made again: a `.part` file of an earlier, interrupted run is deleted, and so is this one
    /// where it is not finished (a full disk). When false the earlier one is moved to `.part.1`, `.part.2`, ..., and this
    /// one stays.
    pub replace_part: bool,
}

impl Default for RecorderOptions {
    fn default() -> Self {
        Self { depth: DepthEncoding::Packed, chunk_bytes: 4 << 20, replace_part: false }
    }
}

/// The content of a finished recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordingSummary {
    /// The file.
    pub path: PathBuf,
    /// Frames in it.
    pub frames: u64,
    /// Its size.
    pub bytes: u64,
}
