//! The axis of a turntable from camera poses.

use nalgebra::{Isometry3, Matrix3, Point3, SymmetricEigen, Translation3, UnitQuaternion, Vector3};
use toile_geometry::Rigid;

/// A resting axis that the cameras turn about, model frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// The point of the axis nearest to the frame's origin.
    pub point: Point3<f64>,
    /// Unit direction such that the turn is positive about it.
    pub direction: Vector3<f64>,
}

impl Axis {
    /// The rotation by `angle` about the axis.
    pub fn turn(&self, angle: f64) -> Rigid {
        let rotation = UnitQuaternion::from_axis_angle(&nalgebra::Unit::new_normalize(self.direction), angle);
        let about = self.point.coords;
        Isometry3::from_parts(Translation3::from(about - rotation * about), rotation)
    }

    /// The same axis, with its direction on the side of `up`.
    pub(crate) fn pointing_along(self, up: &Vector3<f64>) -> Self {
        let sign = if self.direction.dot(up) < 0.0 { -1.0 } else { 1.0 };
        Self { direction: self.direction * sign, ..self }
    }

    /// The part of a motion's rotation that is about the axis, radians.
    pub fn angle(&self, motion: &Rigid) -> f64 {
        motion.rotation.scaled_axis().dot(&self.direction)
    }
}

/// The axis that camera poses turn about: the direction in which their relative rotations agree and the point that
/// their motions move least. `None` where there are fewer than three poses, or too little rotation.
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

/// Motions between poses far enough apart for a rotation to show.
fn spans(poses: &[Rigid]) -> Vec<Rigid> {
    let step = (poses.len() / 8).clamp(1, 12);
    (step..poses.len()).map(|k| poses[k] * poses[k - step].inverse()).collect()
}

/// The widest turn about the axis between two poses that follow each other, radians.
pub fn widest_step(axis: &Axis, poses: &[Rigid]) -> f64 {
    poses.windows(2).map(|w| axis.angle(&(w[1] * w[0].inverse())).abs()).fold(0.0, f64::max)
}

/// The turn about the axis that poses in order sweep, from the least to the most turned one, radians: of a disk that goes
/// back and forth the way forth, of one that goes round twice both turns.
pub fn swept_turn(axis: &Axis, poses: &[Rigid]) -> f64 {
    let mut angle = 0.0;
    let mut ends = (0.0f64, 0.0f64);
    for pair in poses.windows(2) {
        angle += axis.angle(&(pair[1] * pair[0].inverse()));
        ends = (ends.0.min(angle), ends.1.max(angle));
    }
    ends.1 - ends.0
}
