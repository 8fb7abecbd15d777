//! How to stream, and how well it went.

use std::time::Duration;

/// How to stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// Buffers that the kernel may fill ahead of us. Default 8: a quarter of a second.
    pub buffers: u32,
    /// After this long without a frame the stream is switched off and on once; after as long again that is an error.
    /// Default 2 s.
    pub frame_limit: Duration,
}

impl Default for Settings {
    fn default() -> Self {
        Self { buffers: 8, frame_limit: Duration::from_secs(2) }
    }
}

/// How well it went so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Health {
    /// Frames given.
    pub frames: u64,
    /// Frames that the driver lost or kept to itself because they were damaged.
    pub lost: u64,
    /// Frames that came and could not be read.
    pub broken: u64,
    /// How often the stream was switched off and on.
    pub restarts: u32,
}
