//! How to stream.

use std::time::Duration;

use toile_driver_transport::streaming::VideoMode;

use crate::Controls;

/// How to stream.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Default: colour. Infrared is a pair: left beside the depth, right as a sensor of its own.
    pub video: VideoMode,
    /// Columns and rows of depth and infrared. Default 640×480, which every model has over USB 2 and 3.
    pub size: (u32, u32),
    /// Columns and rows of colour. Default 640×480.
    pub color_size: (u32, u32),
    /// Frames a second of all streams. Default 30.
    pub fps: u32,
    /// Laser, exposure and preset; default: as the camera has them.
    pub controls: Controls,
    /// Buffers of each stream that the kernel may fill ahead of us. Default 8: a quarter of a second.
    pub buffers: u32,
    /// After so long without a frame the streams are switched off and on once; after as long again that is an error.
    /// Default 3 s: exposure settles before the first frame.
    pub frame_limit: Duration,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            video: VideoMode::Color,
            size: (640, 480),
            color_size: (640, 480),
            fps: 30,
            controls: Controls::default(),
            buffers: 8,
            frame_limit: Duration::from_secs(3),
        }
    }
}
