//! The result of the stage.

use std::fmt::Write;

use toile_geometry::{Mesh, Rigid};

use crate::{report::FusionReport, timings::Timings, tracking::Tracked};

/// A frame of the scan.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackedFrame {
    /// Index in the source.
    pub index: u64,
    /// Device time of the depth frame, nanoseconds.
    pub device_time_ns: i64,
    /// Pose of the depth camera in the scan's frame.
    pub scan_from_camera: Rigid,
    /// The result of tracking when the frame was first registered; `None` for known poses and the first frame.
    pub tracked: Option<Tracked>,
}

/// A fused take. Scan frame: metres, +Y up along the axis of the turn, origin where the axis meets the disk's top
/// (without a disk: on the axis at the scan's lowest point), +Z towards the camera at the first frame.
#[derive(Debug, Clone)]
pub struct Scan {
    /// The surface: normals, colours (where there was colour), attribute `filled`.
    pub mesh: Mesh,
    /// The fused frames in the order of time.
    pub trajectory: Vec<TrackedFrame>,
    /// The decisions.
    pub report: FusionReport,
    /// How long it took.
    pub timings: Timings,
}

impl Scan {
    /// The trajectory as TUM lines: `t tx ty tz qx qy qz qw`, t in seconds of device time, pose = scan_from_camera.
    pub fn trajectory_tum(&self) -> String {
        let mut text = String::new();
        for frame in &self.trajectory {
            let (t, q) = (frame.scan_from_camera.translation.vector, frame.scan_from_camera.rotation);
            let (seconds, nanos) =
                (frame.device_time_ns.div_euclid(1_000_000_000), frame.device_time_ns.rem_euclid(1_000_000_000));
            let _ = writeln!(
                text,
                "{seconds}.{nanos:09} {:.9} {:.9} {:.9} {:.9} {:.9} {:.9} {:.9}",
                t.x, t.y, t.z, q.i, q.j, q.k, q.w
            );
        }
        text
    }
}
