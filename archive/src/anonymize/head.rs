//! The head in depth images: found by its height in the scan, and replaced by a smooth one.

use nalgebra::{Point3, Vector3};
use toile_capture::{DepthImage, Sensor, TimedPose};
use toile_geometry::Mesh;

use super::smooth_head::SmoothHead;

/// From the top of the scan to below the chin, metres: menton to vertex of the tallest heads (0.26 m, ANSUR II, 99 %), and room for
/// hair and a chin that is held low.
const HEAD: f64 = 0.32;
/// What is behind the head is taken away so far around it, metres, so that no outline of the real one stays in it: noses stick out
/// of the ellipse by 30 mm at most, hair by more.
const AROUND: f64 = 0.08;
/// What is as high as the head but farther from its axis is something else, such as a raised hand, metres.
const BESIDE: f64 = 0.3;
/// A frame whose time is in no pose counts as one whose head nobody knows, nanoseconds.
const SAME_TIME_NS: i64 = 2_000_000;

/// Where the head is in every frame of a take.
pub(super) struct Head {
    poses: Vec<TimedPose>,
    sensor: Sensor,
    /// What lies higher in the scan is head, metres.
    from_height: f64,
    smooth: SmoothHead,
}

impl Head {
    /// Of a take's scan and the camera's way; `None` where the scan is empty.
    pub(super) fn of(scan: &Mesh, poses: Vec<TimedPose>, sensor: &Sensor) -> Option<Self> {
        let top = f64::from(scan.bounds()?.1.y);
        let smooth = SmoothHead::of(scan, top - HEAD, top)?;
        Some(Self { poses, sensor: sensor.clone(), from_height: top - HEAD, smooth })
    }

    /// The image with a smooth head in place of the person's; `None` where nobody knows where the camera was.
    pub(super) fn replace(&self, depth: &DepthImage, time_ns: i64) -> Option<DepthImage> {
        let pose = self.poses.iter().min_by_key(|pose| (pose.time_ns - time_ns).abs())?;
        if (pose.time_ns - time_ns).abs() > SAME_TIME_NS {
            return None;
        }
        let (scale, (centre, radius)) = (self.sensor.depth_scale, self.smooth.ball(AROUND));
        let origin = Point3::from(pose.pose.translation.vector);
        let pixel = |(at, value): (usize, &u16)| {
            let (u, v) = ((at % depth.width as usize) as f64, (at / depth.width as usize) as f64);
            let way = pose.pose.rotation * self.sensor.depth.unproject(u, v, 1.0).coords;
            let seen = (*value > 0).then(|| f64::from(*value) * scale);
            let is_head = seen.is_some_and(|seen| self.is_head(&(origin + way * seen), &centre));
            let Some(range) = through(&origin, &way, &centre, radius) else { return if is_head { 0 } else { *value } };
            let met = self.smooth.meet(&origin, &way, range, AROUND);
            // What stands before the head, such as an arm, is not of it.
            if !is_head && seen.is_some_and(|seen| seen < met.at.unwrap_or(range[0])) {
                return *value;
            }
            match met.at {
                Some(at) => (at / scale).round().clamp(1.0, f64::from(u16::MAX)) as u16,
                None if is_head
                    || (met.near && !seen.is_some_and(|seen| self.is_trunk(&(origin + way * seen), &centre))) =>
                {
                    0
                }
                None => *value,
            }
        };
        Some(DepthImage { values: depth.values.iter().enumerate().map(pixel).collect(), ..*depth })
    }

    fn is_head(&self, point: &Point3<f64>, centre: &Point3<f64>) -> bool {
        point.y > self.from_height && is_beside(point, centre)
    }

    /// True for the body below the head.
    fn is_trunk(&self, point: &Point3<f64>, centre: &Point3<f64>) -> bool {
        point.y <= self.from_height && is_beside(point, centre)
    }
}

fn is_beside(point: &Point3<f64>, centre: &Point3<f64>) -> bool {
    (point.x - centre.x).hypot(point.z - centre.z) < BESIDE
}

/// The depths at which a ray enters and leaves a ball, where it does so in front of the camera.
fn through(origin: &Point3<f64>, way: &Vector3<f64>, centre: &Point3<f64>, radius: f64) -> Option<[f64; 2]> {
    let to = centre - origin;
    let (a, b) = (way.norm_squared(), way.dot(&to));
    let root = b * b - a * (to.norm_squared() - radius * radius);
    let range = [(b - root.max(0.0).sqrt()) / a, (b + root.max(0.0).sqrt()) / a];
    (root > 0.0 && range[1] > 0.0).then_some([range[0].max(0.0), range[1]])
}

#[cfg(test)]
mod tests {
    use toile_geometry::{Rigid, camera::PinholeCamera};

    use super::*;

    /// A camera two metres in front of a person's side, at the height of the head: the nose sticks out to the right.
    fn sensor() -> (Sensor, Rigid) {
        let sensor = Sensor {
            name: "front".into(),
            identity: toile_capture::DeviceIdentity::default(),
            depth: PinholeCamera::ideal(160, 160, 300.0, 300.0, 80.0, 80.0),
            depth_scale: 0.001,
            color: None,
            color_from_depth: Rigid::identity(),
            rig_from_depth: Rigid::identity(),
            fps: 30.0,
        };
        // The camera's +Y is down.
        let turned = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        (sensor, Rigid::from_parts(nalgebra::Translation3::new(0.0, 1.6, 2.0), turned))
    }

    /// Half the width of a column with a head of 0.16 m and a nose of `nose` metres, on the side of the nose.
    fn half(height: f64, nose: f64) -> f64 {
        0.08 + nose * (-((height - 1.58) / 0.015).powi(2)).exp()
    }

    /// Its depth image before a wall, and its scan: the upper part of the column.
    fn person(nose: f64) -> (DepthImage, Mesh) {
        let (sensor, pose) = sensor();
        let pixel = |at: usize| {
            let way = pose.rotation * sensor.depth.unproject((at % 160) as f64, (at / 160) as f64, 1.0).coords;
            let at_axis = Point3::from(pose.translation.vector) + way * 2.0;
            let inside = at_axis.y < 1.75 && at_axis.x < half(at_axis.y, nose) && at_axis.x > -0.08;
            if inside { 1950 } else { 3500 }
        };
        let values = (0..160 * 160).map(pixel).collect();
        let ring = |row: usize| {
            let height = 1.3 + 0.005 * row as f64;
            (0..36).map(move |k| {
                let angle = f64::from(k) * std::f64::consts::PI / 18.0;
                let wide = if k == 0 { half(height, nose) } else { 0.08 };
                Point3::new((wide * angle.cos()) as f32, height as f32, (0.08 * angle.sin()) as f32)
            })
        };
        let scan = Mesh::new((0..=90).flat_map(ring).collect(), Vec::new());
        (DepthImage { width: 160, height: 160, values }, scan)
    }

    fn replaced(nose: f64) -> DepthImage {
        let ((image, scan), (sensor, pose)) = (person(nose), sensor());
        let head = Head::of(&scan, vec![TimedPose { time_ns: 5, pose }], &sensor).unwrap();
        assert!(head.replace(&image, 1_000_000_000).is_none());
        head.replace(&image, 5).unwrap()
    }

    #[test]
    fn the_outline_of_a_nose_is_gone_and_the_body_below_stays() {
        let (flat, long) = (person(0.0).0, person(0.03).0);
        let differ = |a: &DepthImage, b: &DepthImage| a.values.iter().zip(&b.values).filter(|(a, b)| a != b).count();
        let before = differ(&flat, &long);
        assert!(before > 10, "{before} pixels show the nose");
        let kind = |image: DepthImage| {
            let values = image.values.iter().map(|value| u16::from(*value > 0) + u16::from(*value > 3000)).collect();
            DepthImage { values, ..image }
        };
        let after = differ(&kind(replaced(0.0)), &kind(replaced(0.03)));
        assert!(after < before / 5, "{after} of {before} pixels still show the nose");
        // A row of the trunk, 0.4 m below the head's middle, and the wall beside it.
        let row = |image: &DepthImage| image.values[150 * 160..151 * 160].to_vec();
        assert_eq!(row(&flat), row(&replaced(0.0)));
    }

    #[test]
    fn what_replaces_it_is_a_head_of_the_same_size_without_an_edge() {
        let image = replaced(0.0);
        // The front of the head at its middle: the column's is 0.08 m before its axis.
        let middle = image.values[80 * 160 + 80];
        assert!((1905..1935).contains(&middle), "{middle}");
        // Around it, the wall is gone.
        assert_eq!(image.values[80 * 160 + 80 + 18], 0);
        assert_eq!(image.values[80 * 160 + 5], 3500);
    }
}
