//! Losses of a torn or damaged recording.

use std::fmt;

use serde::Serialize;

/// The losses of a torn or damaged recording.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Loss {
    /// Bytes that could not be read: after the last whole chunk, and in damaged ones.
    pub bytes: u64,
    /// Chunks whose checksum does not hold.
    pub damaged_chunks: u32,
    /// Numbers missing between the frames that were read (frames of damaged chunks).
    pub missing_frames: u64,
    /// Images in whole chunks that cannot be assigned to a sensor, because what declared them was in a damaged chunk.
    pub orphan_images: u64,
    /// True when the file was never closed or is cut off: frames after the last one that was read may be gone.
    pub torn: bool,
    /// True when bytes outside of the chunks were changed: the calibration may be wrong, or chunks may be missing.
    pub damaged_outside: bool,
    /// Frames that could be read.
    pub frames_read: u64,
}

impl fmt::Display for Loss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} frames were read", self.frames_read)?;
        if self.torn {
            write!(f, "; the recording was not closed or is cut off")?;
        }
        match self.damaged_chunks {
            0 => {}
            1 => write!(f, "; 1 chunk is damaged")?,
            n => write!(f, "; {n} chunks are damaged")?,
        }
        if self.damaged_outside {
            write!(f, "; its head or the bytes between its chunks are damaged, so that the calibration may be wrong")?;
        }
        if self.missing_frames > 0 {
            write!(f, "; {} frames among them are lost", self.missing_frames)?;
        }
        if self.orphan_images > 0 {
            write!(f, "; {} images cannot be assigned to a sensor", self.orphan_images)?;
        }
        write!(f, "; {} bytes could not be read", self.bytes)
    }
}

/// How reading the file ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Ending {
    /// True when the end of the data was reached as the writer meant it.
    pub(super) closed: bool,
    /// Bytes after the last whole record.
    pub(super) torn_bytes: u64,
    /// Chunks whose checksum does not hold, or whose records cannot be read.
    pub(super) damaged_chunks: u32,
    /// Bytes in them.
    pub(super) damaged_bytes: u64,
    /// True when the checksum over all data does not hold although the chunks are whole.
    pub(super) damaged_outside: bool,
}

impl Ending {
    /// Counts a chunk of `bytes` bytes as damaged.
    pub(super) fn add_damaged(&mut self, bytes: u64) {
        self.damaged_chunks = self.damaged_chunks.saturating_add(1);
        self.damaged_bytes = self.damaged_bytes.saturating_add(bytes);
    }

    /// The loss, where there is any. `frame_count` frames were read, whose highest number is `last_index`.
    pub(super) fn loss(&self, frame_count: u64, last_index: Option<u64>, orphans: u64) -> Option<Loss> {
        if self.closed && self.damaged_chunks == 0 && !self.damaged_outside && orphans == 0 {
            return None;
        }
        let expected = last_index.map_or(0, |last| last.saturating_add(1));
        Some(Loss {
            bytes: self.torn_bytes.saturating_add(self.damaged_bytes),
            damaged_chunks: self.damaged_chunks,
            missing_frames: expected.saturating_sub(frame_count),
            orphan_images: orphans,
            torn: !self.closed,
            damaged_outside: self.damaged_outside,
            frames_read: frame_count,
        })
    }
}
