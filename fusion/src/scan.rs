//! The result of the stage.

use std::fmt::Write;

use toile_geometry::{Mesh, Rigid};

use crate::{report::FusionReport, timings::Timings, tracking::Tracked};

/// A frame of the scan.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackedFrame {
    /// Which sensor of the rig saw it.
    pub sensor: usize,
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
    /// The fused frames: those of the leading sensor in the order of time, then those of each other one.
    pub trajectory: Vec<TrackedFrame>,
    /// The decisions.
    pub report: FusionReport,
    /// How long it took.
    pub timings: Timings,
}

impl Scan {
    /// The trajectory as TUM lines: `t tx ty tz qx qy qz qw`, t in seconds of device time, pose = scan_from_camera. Of
    /// several sensors, each with a clock of its own, the lines of each follow a comment that names it.
    pub fn trajectory_tum(&self) -> String {
        let mut text = String::new();
        let several = self.trajectory.windows(2).any(|w| w[0].sensor != w[1].sensor);
        let mut last = usize::MAX;
        for frame in &self.trajectory {
            if several && frame.sensor != last {
                let name = self.report.sensors.get(frame.sensor).map_or("", |s| s.name.as_str());
                let _ = writeln!(text, "# sensor {name}");
            }
            last = frame.sensor;
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
