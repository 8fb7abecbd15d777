//! The channels of a sensor.

/// A channel of one sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Stream {
    Depth,
    Color,
    RawColor,
    DepthCalibration,
    ColorCalibration,
}

impl Stream {
    /// The end of its topic, behind the sensor's name.
    pub(super) fn topic(self) -> &'static str {
        match self {
            Self::Depth => "depth/image",
            Self::Color => "color/image",
            Self::RawColor => "color/raw",
            Self::DepthCalibration => "depth/calibration",
            Self::ColorCalibration => "color/calibration",
        }
    }

    /// Which camera it belongs to.
    pub(super) fn role(self) -> &'static str {
        match self {
            Self::Depth | Self::DepthCalibration => "depth",
            Self::Color | Self::RawColor | Self::ColorCalibration => "color",
        }
    }
}
