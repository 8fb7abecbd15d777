//! How well it went.

use crate::assembler::Losses;

/// How well it went so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Health {
    /// Losses of the depth stream.
    pub depth: Losses,
    /// Losses of the video stream.
    pub video: Losses,
    /// Frames given.
    pub frames: u64,
    /// Frames of which nothing could be given.
    pub lost_frames: u64,
    /// Frames given without colour, and without depth.
    pub alone: [u64; 2],
    /// How often the streams were switched off and on.
    pub restarts: u32,
}
