//! The findings of an inspection, as values.

use serde::Serialize;

use crate::Loss;

/// The findings of [`inspect`](crate::inspect()).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Inspection {
    /// The path that was inspected.
    pub path: String,
    /// The subject's name and date, where it is one.
    pub subject: Option<SubjectInspection>,
    /// One entry a take; one for a single recording or folder.
    pub takes: Vec<TakeInspection>,
    /// True where no take has a problem.
    pub healthy: bool,
    /// True where recorded data was lost: a torn or damaged file, frames or colour images that are not readable.
    pub data_lost: bool,
}

/// A subject's head.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SubjectInspection {
    /// Its name.
    pub name: String,
    /// Date of the visit.
    pub date: String,
    /// What is remarkable about its folder, a sentence each.
    pub remarks: Vec<String>,
}

/// One recording or folder.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct TakeInspection {
    /// Layer label such as `01-trousers`, or the file's name.
    pub name: String,
    /// The type of the garment that it shows, where it is known.
    pub garment: Option<String>,
    /// `mcap`, the layout of a folder, or `scan`.
    pub format: String,
    /// Size of the recording, bytes; 0 for folders.
    pub bytes: u64,
    /// Frames that can be read.
    pub frames: u64,
    /// Seconds from the first to the last frame, by the device's clock.
    pub duration_s: f64,
    /// Its sensors.
    pub sensors: Vec<SensorInspection>,
    /// The mesh, where it is a finished scan instead of a recording.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scan: Option<ScanInspection>,
    /// The losses of a torn or damaged file.
    pub loss: Option<Loss>,
    /// Frames that cannot be read, with the reason.
    pub unreadable: Vec<String>,
    /// Problems, a sentence each; empty where the take is healthy.
    pub problems: Vec<String>,
}

impl TakeInspection {
    /// True where recorded data was lost.
    pub fn data_lost(&self) -> bool {
        let is_damaged = |sensor: &SensorInspection| !sensor.damaged_color.is_empty();
        self.loss.is_some() || !self.unreadable.is_empty() || self.sensors.iter().any(is_damaged)
    }
}

/// The mesh of a take that is a finished scan.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct ScanInspection {
    /// The mesh file.
    pub file: String,
    /// Vertices in the file.
    pub vertices: u64,
    /// Triangles in the file.
    pub triangles: u64,
    /// The unit of its lengths, as said or found from the size of a person; `None` where none fits.
    pub unit: Option<String>,
    /// True where somebody said the unit.
    pub unit_said: bool,
    /// The axis that points up, where somebody said it.
    pub up_said: Option<String>,
    /// True where it has colours.
    pub has_colors: bool,
    /// Pictures that it is coloured with.
    pub pictures: u64,
}

/// One sensor of a take.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct SensorInspection {
    /// Its name in the rig.
    pub name: String,
    /// Device model.
    pub model: String,
    /// Serial number.
    pub serial: String,
    /// Depth columns and rows.
    pub depth_size: [u32; 2],
    /// Colour columns and rows, where there is colour.
    pub color_size: Option<[u32; 2]>,
    /// Frames of this sensor.
    pub frames: u64,
    /// Nominal frames a second, 0 where unknown.
    pub fps_nominal: f64,
    /// Measured frames a second, by the device's clock (lost frames counted as if they were there).
    pub fps_measured: f64,
    /// Frames lost, by the device's numbers.
    pub lost_frames: u64,
    /// Where they are missing.
    pub gaps: Vec<Gap>,
    /// Device numbers of frames without depth.
    pub without_depth: Vec<u64>,
    /// Device numbers of frames without colour, where the sensor has colour.
    pub without_color: Vec<u64>,
    /// Device numbers of frames whose colour image is damaged (cut off, or not decodable to its end).
    pub damaged_color: Vec<u64>,
    /// Share of depth pixels that are not 0, over all frames.
    pub depth_valid_share: f64,
    /// Device numbers of frames whose time is not later than the frame's before.
    pub times_backwards: Vec<u64>,
}

/// Frames missing in a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Gap {
    /// Device number of the first frame after the gap.
    pub before_frame: u64,
    /// How many are missing.
    pub missing: u32,
}
