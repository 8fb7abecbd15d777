//! How well it went.

/// Losses of a stream so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Losses {
    /// Packets (depth) or transfers (colour) that the bus lost or damaged.
    pub packets: u64,
    /// Images that arrived but cannot be used: wrong length, wrong footer, not a JPEG, out of place.
    pub bad: u64,
    /// Frames that were begun and are not whole.
    pub torn_frames: u64,
}

/// How well it went so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Health {
    /// Losses of the depth stream.
    pub depth: Losses,
    /// Losses of the colour stream.
    pub color: Losses,
    /// Frames given.
    pub frames: u64,
    /// Frames of which nothing could be given.
    pub lost_frames: u64,
    /// Frames given without colour, and without depth.
    pub alone: [u64; 2],
    /// How often the streams were switched off and on.
    pub restarts: u32,
}
