//! The rigid transform between two sets of points.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// A point, where it is to go, and its weight.
pub(super) type Pair = (Point3<f64>, Point3<f64>, f64);

/// The rigid transform that takes `from` nearest to `to`, weighted (Kabsch 1976). `None` without weight. Where the points lie on a line, the
/// turn about it is any.
pub(super) fn rigid_fit(pairs: impl Iterator<Item = Pair> + Clone) -> Option<Isometry3<f64>> {
    let (mut from, mut to, mut sum) = (Vector3::zeros(), Vector3::zeros(), 0.0);
    for (a, b, w) in pairs.clone() {
        from += w * a.coords;
        to += w * b.coords;
        sum += w;
    }
    if sum <= 0.0 {
        return None;
    }
    let (from, to) = (from / sum, to / sum);
    let spread: Matrix3<f64> = pairs.map(|(a, b, w)| w * (b.coords - to) * (a.coords - from).transpose()).sum();
    let svd = spread.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let mirror = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v_t).determinant().signum()));
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(u * mirror * v_t));
    Some(Isometry3::from_parts(Translation3::from(to - turn * from), turn))
}
