//! The head in depth images: found by its height in the scan, and smoothed.

use toile_capture::{DepthImage, Sensor, TimedPose};
use toile_geometry::Mesh;

/// From the top of the scan to below the chin, metres: menton to vertex of the tallest heads (0.26 m, ANSUR II, 99 %), and room for
/// hair and a chin that is held low.
const HEAD: f64 = 0.32;
/// Radius of the box over which depth is averaged, metres, and how often: together a Gaussian of about 35 mm, under which
/// noses, lips and eye sockets (features of 10 to 40 mm) are flat.
const RADIUS: f64 = 0.035;
const PASSES: usize = 3;
/// Depth that differs by more belongs to something else, metres.
const STEP: f64 = 0.12;
/// A frame whose time is in no pose counts as one whose head nobody knows, nanoseconds.
const SAME_TIME_NS: i64 = 2_000_000;

/// Where the head is in every frame of a take.
pub(super) struct Head {
    poses: Vec<TimedPose>,
    sensor: Sensor,
    /// What lies higher in the scan is head, metres.
    from_height: f64,
}

impl Head {
    /// Of a take's scan and the camera's way; `None` where the scan is empty.
    pub(super) fn of(scan: &Mesh, poses: Vec<TimedPose>, sensor: &Sensor) -> Option<Self> {
        let top = f64::from(scan.bounds()?.1.y);
        Some(Self { poses, sensor: sensor.clone(), from_height: top - HEAD })
    }

    /// The image with the head smoothed; `None` where nobody knows where the camera was.
    pub(super) fn smooth(&self, depth: &DepthImage, time_ns: i64) -> Option<DepthImage> {
        let pose = self.poses.iter().min_by_key(|pose| (pose.time_ns - time_ns).abs())?;
        if (pose.time_ns - time_ns).abs() > SAME_TIME_NS {
            return None;
        }
        let (width, height) = (depth.width as usize, depth.height as usize);
        let camera = &self.sensor.depth;
        let metres = |value: u16| f64::from(value) * self.sensor.depth_scale;
        let is_head = |at: usize| {
            let value = depth.values[at];
            let point = camera.unproject((at % width) as f64, (at / width) as f64, metres(value));
            value > 0 && (pose.pose * point).y > self.from_height
        };
        let head: Vec<usize> = (0..width * height).filter(|at| is_head(*at)).collect();
        let mut values = depth.values.clone();
        for _ in 0..PASSES {
            let before = values.clone();
            for at in &head {
                let z = metres(before[*at]);
                let reach = (RADIUS * camera.fx / z).ceil() as usize;
                values[*at] = mean(&before, [width, height], *at, reach, (STEP / self.sensor.depth_scale) as u16);
            }
        }
        Some(DepthImage { values, ..*depth })
    }
}

/// Mean of the depth around a pixel that belongs to the same surface.
fn mean(values: &[u16], [width, height]: [usize; 2], at: usize, reach: usize, step: u16) -> u16 {
    let (u, v, own) = (at % width, at / width, values[at]);
    let (mut sum, mut count) = (0u64, 0u64);
    for row in v.saturating_sub(reach)..(v + reach + 1).min(height) {
        for value in &values[row * width + u.saturating_sub(reach)..row * width + (u + reach + 1).min(width)] {
            if *value > 0 && value.abs_diff(own) <= step {
                sum += u64::from(*value);
                count += 1;
            }
        }
    }
    (sum / count.max(1)) as u16
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;
    use toile_geometry::{Rigid, camera::PinholeCamera};

    use super::*;

    #[test]
    fn what_is_high_is_smoothed_and_what_is_low_stays() {
        let depth = PinholeCamera::ideal(120, 160, 100.0, 100.0, 60.0, 80.0);
        let sensor = Sensor {
            name: "front".into(),
            identity: toile_capture::DeviceIdentity::default(),
            depth,
            depth_scale: 0.001,
            color: None,
            color_from_depth: Rigid::identity(),
            rig_from_depth: Rigid::identity(),
            fps: 30.0,
        };
        // A wall one metre away with a bump of 20 mm at the top and one at the bottom; the camera looks level, its +Y is down.
        let bump = |at: usize| {
            usize::from([40, 130].iter().any(|row| (at / 120).abs_diff(*row) < 2 && (at % 120).abs_diff(60) < 2))
        };
        let values: Vec<u16> = (0..120 * 160).map(|at| 1000 - 20 * bump(at) as u16).collect();
        let image = DepthImage { width: 120, height: 160, values };
        let turned = nalgebra::UnitQuaternion::from_axis_angle(&nalgebra::Vector3::x_axis(), std::f64::consts::PI);
        let pose = Rigid::from_parts(nalgebra::Translation3::identity(), turned);
        let scan = Mesh::new(vec![Point3::new(0.0, 0.6, 0.0), Point3::new(0.0, -1.0, 0.0)], Vec::new());
        let head = Head::of(&scan, vec![TimedPose { time_ns: 5, pose }], &sensor).unwrap();
        let smooth = head.smooth(&image, 5).unwrap();
        let at = |row: usize| smooth.values[row * 120 + 60];
        assert!(at(40) > 995, "{}", at(40));
        assert_eq!((at(130), smooth.values[0]), (980, 1000));
        assert!(head.smooth(&image, 1_000_000_000).is_none());
    }
}
