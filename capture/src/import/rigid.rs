//! Rigid transforms from matrices of other people's files.

use nalgebra::{Matrix3, Matrix4, Rotation3, Translation3, UnitQuaternion, Vector3};
use toile_geometry::Rigid;

/// A rigid transform from a 4×4 matrix whose rotation may be rounded; `None` where it is not a
/// rotation.
pub(super) fn rigid_from_matrix(matrix: &Matrix4<f64>) -> Option<Rigid> {
    let rotation = matrix.fixed_view::<3, 3>(0, 0).into_owned();
    rigid_from_parts(&rotation, matrix.fixed_view::<3, 1>(0, 3).into_owned())
}

/// A rigid transform from a rotation matrix, which may be rounded, and a translation; `None` where it is not a rotation.
pub(super) fn rigid_from_parts(rotation: &Matrix3<f64>, translation: Vector3<f64>) -> Option<Rigid> {
    let finite = rotation.iter().chain(translation.iter()).all(|x| x.is_finite());
    let error = (rotation.transpose() * rotation - Matrix3::identity()).norm();
    if !finite || error > 0.01 || rotation.determinant() < 0.0 {
        return None;
    }
    let rotation = Rotation3::from_matrix_eps(rotation, 1e-12, 100, Rotation3::identity());
    Some(Rigid::from_parts(Translation3::from(translation), UnitQuaternion::from_rotation_matrix(&rotation)))
}
