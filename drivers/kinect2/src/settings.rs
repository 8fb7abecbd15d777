//! How to stream.

use std::time::Duration;

use crate::DecodeSettings;

/// The images that come with depth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ColorMode {
    /// The colour of each depth pixel, by the device's registration: 512×424.
    #[default]
    Registered,
    /// The whole colour image, 1920×1080, with the colour camera's place in the rig. A take of it needs 190 MB/s of disk.
    Full,
    /// Nothing.
    Off,
}

/// How to stream.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Default: registered.
    pub color: ColorMode,
    /// The depth that is dropped.
    pub decode: DecodeSettings,
    /// Depth transfers in flight, of a millisecond each. Default 56: with colour's just below the 16 MB that Linux gives
    /// USB programs.
    pub transfers: usize,
    /// How long a command may take. Default 1 s, as libfreenect2 gives.
    pub command_limit: Duration,
    /// How long the camera may take until it is ready. Default 5 s.
    pub ready_limit: Duration,
    /// After so long without a frame the streams are switched off and on once; after as long again that is an error.
    /// Default 2 s.
    pub frame_limit: Duration,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            color: ColorMode::Registered,
            decode: DecodeSettings::default(),
            transfers: 56,
            command_limit: Duration::from_secs(1),
            ready_limit: Duration::from_secs(5),
            frame_limit: Duration::from_secs(2),
        }
    }
}
