//! How well it went.

/// How well it went so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Health {
    /// Frames given.
    pub frames: u64,
    /// Frames of which nothing could be given.
    pub lost_frames: u64,
    /// Depth and colour (or infrared) pictures that the kernel lost, or kept to itself because they were damaged.
    pub lost_pictures: [u64; 2],
    /// Frames given without colour, and without depth.
    pub alone: [u64; 2],
    /// Pictures that came and could not be read.
    pub broken: u64,
    /// Pictures that came without the camera's time, which are lost while others have one.
    pub without_time: u64,
    /// How often the streams were switched off and on.
    pub restarts: u32,
}
