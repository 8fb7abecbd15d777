//! The next pose by the motion so far: a turntable's axis and rate, estimated while frames come, or
//! constant velocity.

use nalgebra::{Isometry3, Rotation3, Translation3, UnitQuaternion};
use toile_geometry::{Rigid, statistics::median};

use super::axis::{Axis, find_axis};
use crate::settings::Prior;

/// Poses over which the axis is taken.
const RECENT: usize = 60;
/// Steps over which the present rate is taken.
const RATE_STEPS: usize = 5;
/// Smallest turn over which an axis is believed, radians.
const AXIS_TURN: f64 = 0.12;

/// The camera's pose at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TimedPose {
    /// Device time, nanoseconds.
    pub time_ns: i64,
    pub model_from_camera: Rigid,
}

/// Trusted poses in the order of time.
#[derive(Debug, Clone)]
pub(crate) struct MotionModel {
    prior: Prior,
    poses: Vec<TimedPose>,
}

impl MotionModel {
    /// A model of a motion about which nothing is known yet.
    pub(crate) fn new(prior: Prior) -> Self {
        Self { prior, poses: Vec::new() }
    }

    /// Adds a trusted pose.
    pub(crate) fn push(&mut self, pose: TimedPose) {
        self.poses.push(pose);
    }

    /// True when there is a rate to predict with.
    pub(crate) fn knows_rate(&self) -> bool {
        self.poses.len() >= 2
    }

    /// The expected pose at a time; the last pose where nothing more is known.
    pub(crate) fn predict(&self, time_ns: i64) -> Rigid {
        let Some(last) = self.poses.last() else { return Rigid::identity() };
        let Some(before) = self.poses.iter().rev().nth(1) else { return last.model_from_camera };
        if self.axis().is_some() {
            return self.predict_from(last, time_ns);
        }
        let ratio = seconds(time_ns - last.time_ns) / seconds(last.time_ns - before.time_ns).max(1e-6);
        let motion = last.model_from_camera * before.model_from_camera.inverse();
        scaled(&motion, ratio.clamp(-8.0, 8.0)) * last.model_from_camera
    }

    /// The expected pose at a time, had it been another at another time: turned on about the axis, where there is one.
    pub(crate) fn predict_from(&self, then: &TimedPose, time_ns: i64) -> Rigid {
        let pose = then.model_from_camera;
        self.axis().map_or(pose, |axis| axis.turn(self.rate(&axis) * seconds(time_ns - then.time_ns)) * pose)
    }

    /// Where a disk that has stopped or turned back since the last pose has brought the subject; nothing without an axis.
    pub(crate) fn stopped_or_back(&self, time_ns: i64) -> Vec<Rigid> {
        let Some((axis, last)) = self.axis().zip(self.poses.last()) else { return Vec::new() };
        let turn = self.rate(&axis) * seconds(time_ns - last.time_ns);
        [0.0, -0.5, -1.0, 0.5].map(|share| axis.turn(share * turn) * last.model_from_camera).to_vec()
    }

    /// The axis over the recent poses, where there is a turntable and they turned far enough.
    pub(crate) fn axis(&self) -> Option<Axis> {
        if self.prior != Prior::Turntable {
            return None;
        }
        let from = self.poses.len().saturating_sub(RECENT);
        let recent: Vec<Rigid> = self.poses[from..].iter().map(|p| p.model_from_camera).collect();
        find_axis(&recent).filter(|_| turn_between(recent.first(), recent.last()) > AXIS_TURN)
    }

    /// Median of the last steps' rates about the axis, radians a second.
    fn rate(&self, axis: &Axis) -> f64 {
        let rate = |w: &[TimedPose]| {
            let motion = w[1].model_from_camera * w[0].model_from_camera.inverse();
            axis.angle(&motion) / seconds(w[1].time_ns - w[0].time_ns).max(1e-6)
        };
        let mut rates: Vec<f64> = self.poses.windows(2).rev().take(RATE_STEPS).map(rate).collect();
        median(&mut rates).unwrap_or(0.0)
    }
}

fn turn_between(a: Option<&Rigid>, b: Option<&Rigid>) -> f64 {
    a.zip(b).map_or(0.0, |(a, b)| (b * a.inverse()).rotation.angle())
}

/// A fraction (or multiple) of a rigid motion, rotation and translation apart.
pub(crate) fn scaled(motion: &Rigid, ratio: f64) -> Rigid {
    let rotation = Rotation3::new(motion.rotation.scaled_axis() * ratio);
    Isometry3::from_parts(
        Translation3::from(motion.translation.vector * ratio),
        UnitQuaternion::from_rotation_matrix(&rotation),
    )
}

fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector3};

    use super::*;
    use crate::tracking::axis::swept_turn;

    #[test]
    fn a_turn_about_a_tilted_axis_is_found_and_predicted() {
        let axis = Axis { point: Point3::new(0.1, 0.0, -0.05), direction: Vector3::new(0.05, 1.0, 0.02).normalize() };
        let start = Isometry3::translation(0.0, 1.0, 2.0);
        let pose = |k: usize| axis.turn(-0.06 * k as f64) * start;
        let poses: Vec<Rigid> = (0..30).map(pose).collect();
        let found = find_axis(&poses).expect("they turn");
        assert!((found.direction + axis.direction).norm() < 1e-9, "{found:?}");
        let off = (found.point - axis.point).cross(&axis.direction).norm();
        assert!(off < 1e-9, "{off}");
        assert!((swept_turn(&found, &poses) - 29.0 * 0.06).abs() < 1e-9);
        let mut model = MotionModel::new(Prior::Turntable);
        (0..30).for_each(|k| model.push(TimedPose { time_ns: 200_000_000 * k as i64, model_from_camera: pose(k) }));
        let next = model.predict(200_000_000 * 31);
        assert!((next.inverse() * pose(31)).translation.vector.norm() < 1e-6);
    }
}
