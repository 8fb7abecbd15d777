//! How to stream.

use std::time::Duration;

use toile_driver_transport::streaming::VideoMode;

/// How depth is sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DepthMode {
    /// Eleven bits a pixel: all that the sensor measures.
    #[default]
    Eleven,
    /// Ten bits a pixel: 9 % less of the bus, half the depth resolution.
    Ten,
}

/// How to stream.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Default: eleven bits.
    pub depth: DepthMode,
    /// Colour of 640×480 pixels, or infrared of 640×488. Default: colour.
    pub video: VideoMode,
    /// Give depth as the colour camera sees it, by the device's registration. Default false: depth as it was measured,
    /// with the colour camera's place in the rig.
    pub registered: bool,
    /// Transfers in flight for each stream. Default 16.
    pub transfers: usize,
    /// Packets of each transfer. Default 32: 4 ms.
    pub packets: usize,
    /// How long a command may take. Default 0.5 s (Linux' gspca `kinect.c` gives as much).
    pub command_limit: Duration,
    /// After so long without a frame the streams are switched off and on once; after as long again that is an error.
    /// Default 2 s.
    pub frame_limit: Duration,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            depth: DepthMode::Eleven,
            video: VideoMode::Color,
            registered: false,
            transfers: 16,
            packets: 32,
            command_limit: Duration::from_millis(500),
            frame_limit: Duration::from_secs(2),
        }
    }
}
