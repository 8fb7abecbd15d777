//! What the motion so far says about the next pose: a turntable's axis and rate, estimated on line, or plain
//! constant velocity.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, SymmetricEigen, Translation3, UnitQuaternion, Vector3};
use toile_geometry::{Rigid, statistics::median};

use crate::settings::Prior;

/// Steps over which the present rate is taken.
const RATE_STEPS: usize = 5;
/// Least turn over which an axis is believed, radians.
const AXIS_TURN: f64 = 0.12;

/// Trusted poses in the order of time.
#[derive(Debug, Clone)]
pub struct MotionModel {
    prior: Prior,
    poses: Vec<(i64, Rigid)>,
}

/// A resting axis that the cameras turn about, scan frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// The point of the axis nearest to the scan's origin.
    pub point: Point3<f64>,
    /// Unit direction such that the turn is positive about it.
    pub direction: Vector3<f64>,
}

impl MotionModel {
    /// Nothing known yet.
    pub fn new(prior: Prior) -> Self {
        Self { prior, poses: Vec::new() }
    }

    /// Adds a trusted pose.
    pub fn push(&mut self, time_ns: i64, scan_from_camera: Rigid) {
        self.poses.push((time_ns, scan_from_camera));
    }

    /// The last trusted pose.
    pub fn last(&self) -> Option<&(i64, Rigid)> {
        self.poses.last()
    }

    /// True when there is a rate to predict with.
    pub fn knows_rate(&self) -> bool {
        self.poses.len() >= 2
    }

    /// The expected pose at a time; the last pose where nothing more is known.
    pub fn predict(&self, time_ns: i64) -> Rigid {
        let Some(&(t1, last)) = self.poses.last() else { return Rigid::identity() };
        let Some(&(t0, before)) = self.poses.iter().rev().nth(1) else { return last };
        if self.axis().is_some() {
            return self.predict_from(t1, &last, time_ns);
        }
        let ratio = seconds(time_ns - t1) / seconds(t1 - t0).max(1e-6);
        scaled(&(last * before.inverse()), ratio.clamp(-8.0, 8.0)) * last
    }

    /// The expected pose at a time, had it been `pose` at another: turned on about the axis, where there is one.
    pub fn predict_from(&self, then_ns: i64, pose: &Rigid, time_ns: i64) -> Rigid {
        self.axis().map_or(*pose, |axis| axis.turn(self.rate(&axis) * seconds(time_ns - then_ns)) * pose)
    }

    /// The axis over the recent poses, where there is a turntable and they turned far enough.
    pub fn axis(&self) -> Option<Axis> {
        if self.prior != Prior::Turntable {
            return None;
        }
        let from = self.poses.len().saturating_sub(60);
        let recent: Vec<Rigid> = self.poses[from..].iter().map(|p| p.1).collect();
        find_axis(&recent).filter(|_| turn_between(recent.first(), recent.last()) > AXIS_TURN)
    }

    /// Median of the last steps' rates about the axis, radians a second.
    fn rate(&self, axis: &Axis) -> f64 {
        let steps = self.poses.windows(2).rev().take(RATE_STEPS);
        let mut rates: Vec<f64> =
            steps.map(|w| axis.angle(&(w[1].1 * w[0].1.inverse())) / seconds(w[1].0 - w[0].0).max(1e-6)).collect();
        median(&mut rates).unwrap_or(0.0)
    }
}

impl Axis {
    /// The rotation by `angle` about the axis.
    pub fn turn(&self, angle: f64) -> Rigid {
        let rotation = UnitQuaternion::from_axis_angle(&nalgebra::Unit::new_normalize(self.direction), angle);
        let about = self.point.coords;
        Isometry3::from_parts(Translation3::from(about - rotation * about), rotation)
    }

    /// The part of a motion's rotation that is about the axis, radians.
    pub fn angle(&self, motion: &Rigid) -> f64 {
        motion.rotation.scaled_axis().dot(&self.direction)
    }
}

/// The axis that camera poses turn about: the direction in which their relative rotations agree and the point that
/// their motions move least. `None` where there are fewer than three poses or hardly any rotation.
pub fn find_axis(poses: &[Rigid]) -> Option<Axis> {
    let spans = spans(poses);
    let mut scatter = Matrix3::zeros();
    let mut signed = Vector3::zeros();
    for m in &spans {
        let w = m.rotation.scaled_axis();
        scatter += w * w.transpose();
        signed += w;
    }
    let eigen = SymmetricEigen::new(scatter);
    let k = eigen.eigenvalues.imax();
    if eigen.eigenvalues[k] < 1e-5 {
        return None;
    }
    let d: Vector3<f64> = eigen.eigenvectors.column(k).normalize();
    let direction = if d.dot(&signed) < 0.0 { -d } else { d };
    let (mut a, mut b) = (direction * direction.transpose() * 1e-9, Vector3::zeros());
    for m in &spans {
        let rotation = m.rotation.to_rotation_matrix();
        let lever = Matrix3::identity() - rotation.matrix();
        let across = m.translation.vector - direction * direction.dot(&m.translation.vector);
        a += lever.transpose() * lever;
        b += lever.transpose() * across;
    }
    a += direction * direction.transpose() * a.trace().max(1e-9);
    let point = a.cholesky()?.solve(&b);
    Some(Axis { point: Point3::from(point), direction })
}

/// Motions between poses far enough apart to speak of a rotation.
fn spans(poses: &[Rigid]) -> Vec<Rigid> {
    let step = (poses.len() / 8).clamp(1, 12);
    (step..poses.len()).map(|k| poses[k] * poses[k - step].inverse()).collect()
}

fn turn_between(a: Option<&Rigid>, b: Option<&Rigid>) -> f64 {
    a.zip(b).map_or(0.0, |(a, b)| (b * a.inverse()).rotation.angle())
}

/// Total turn about the axis over poses in order, radians.
pub fn total_turn(axis: &Axis, poses: &[Rigid]) -> f64 {
    poses.windows(2).map(|w| axis.angle(&(w[1] * w[0].inverse()))).sum()
}

/// A fraction (or multiple) of a rigid motion, rotation and translation apart.
fn scaled(motion: &Rigid, ratio: f64) -> Rigid {
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
    use super::*;

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
        assert!((total_turn(&found, &poses) - 29.0 * 0.06).abs() < 1e-9);
        let mut model = MotionModel::new(Prior::Turntable);
        (0..30).for_each(|k| model.push(200_000_000 * k as i64, pose(k)));
        let next = model.predict(200_000_000 * 31);
        assert!((next.inverse() * pose(31)).translation.vector.norm() < 1e-6);
    }
}
