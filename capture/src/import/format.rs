//! The layouts that can be imported, by name.

use std::{fmt, str::FromStr};

/// The layouts that can be imported.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// `depth/`, `color/`, `camera.json`, `timestamps.txt`.
    ToileFolder,
    /// TUM RGB-D.
    Tum,
    /// University of Amsterdam's person turning before a sensor.
    Uva,
    /// Microsoft 7-Scenes.
    SevenScenes,
    /// A recording of Toile's own, or of another program with Foxglove's messages.
    Mcap,
    /// Redwood's data sets.
    Redwood,
    /// Frames listed in `associations.txt`: ICL-NUIM, TUM RGB-D.
    Associated,
    /// Stray Scanner on iPhone and iPad.
    StrayScanner,
    /// libfreenect's `record`.
    Freenect,
    /// Record3D on iPhone and iPad.
    Record3d,
    /// BundleFusion and ScanNet.
    Sens,
    /// A ROS 1 bag; librealsense records such.
    Bag,
    /// An MCAP file with messages of ROS 1 or ROS 2.
    RosMcap,
    /// A ROS 2 bag: its folder, or one SQLite file of it.
    Ros2Bag,
    /// OpenNI.
    Oni,
    /// Matroska as k4arecorder writes it.
    Mkv,
}

impl Format {
    /// Every format, in the order in which they are listed to people.
    pub const ALL: [Self; 16] = [
        Self::ToileFolder,
        Self::Tum,
        Self::Uva,
        Self::SevenScenes,
        Self::Redwood,
        Self::Associated,
        Self::StrayScanner,
        Self::Freenect,
        Self::Record3d,
        Self::Sens,
        Self::Mkv,
        Self::Oni,
        Self::Mcap,
        Self::Bag,
        Self::RosMcap,
        Self::Ros2Bag,
    ];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::ToileFolder => "toile-folder",
            Self::Tum => "tum",
            Self::Uva => "uva",
            Self::SevenScenes => "seven-scenes",
            Self::Mcap => "mcap",
            Self::Redwood => "redwood",
            Self::Associated => "associated",
            Self::StrayScanner => "stray-scanner",
            Self::Freenect => "freenect",
            Self::Record3d => "record3d",
            Self::Sens => "sens",
            Self::Mkv => "mkv",
            Self::Oni => "oni",
            Self::Bag => "bag",
            Self::RosMcap => "ros-mcap",
            Self::Ros2Bag => "ros2-bag",
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Format {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let known = Self::ALL.into_iter().find(|format| format.name() == text);
        known.ok_or_else(|| format!("`{text}` is not a format; choose one of {}", names()))
    }
}

/// All names, for messages.
pub(super) fn names() -> String {
    Format::ALL.map(Format::name).join(", ")
}
