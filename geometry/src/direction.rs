//! Rotations from directions, guarded where directions vanish.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

/// A shorter vector has no direction (metres or the units of a file).
const SHORTEST: f64 = 1e-9;

/// The unit vector along `v`, or `fallback` where `v` vanishes.
pub fn unit_or(v: &Vector3<f64>, fallback: &Vector3<f64>) -> Vector3<f64> {
    v.try_normalize(SHORTEST).unwrap_or(*fallback)
}

/// The smallest rotation that takes direction `from` to direction `to`; none where either vanishes.
pub fn swing(from: &Vector3<f64>, to: &Vector3<f64>) -> UnitQuaternion<f64> {
    let (Some(from), Some(to)) = (from.try_normalize(SHORTEST), to.try_normalize(SHORTEST)) else {
        return UnitQuaternion::identity();
    };
    UnitQuaternion::rotation_between(&from, &to).unwrap_or_else(|| {
        // opposite directions: half a turn about any axis across
        let axis = from.cross(&Vector3::ith_axis(from.iamin()));
        UnitQuaternion::new(unit_or(&axis, &Vector3::x()) * std::f64::consts::PI)
    })
}

/// The frame whose first axis is `primary` and whose second is as near to `secondary` as it can be.
pub fn frame(primary: &Vector3<f64>, secondary: &Vector3<f64>) -> UnitQuaternion<f64> {
    let first = unit_or(primary, &Vector3::x());
    let across = secondary - first * first.dot(secondary);
    let any = first.cross(&Vector3::ith_axis(first.iamin())).normalize();
    let second = unit_or(&across, &any);
    let matrix = Matrix3::from_columns(&[first, second, first.cross(&second)]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix))
}

/// The rotation that takes `from`'s two directions to `to`'s: the first exactly, the second as nearly as can be.
pub fn align(from: [&Vector3<f64>; 2], to: [&Vector3<f64>; 2]) -> UnitQuaternion<f64> {
    frame(to[0], to[1]) * frame(from[0], from[1]).inverse()
}

/// The coordinate axis, with its sign, that is nearest to `v`.
pub fn nearest_axis(v: &Vector3<f64>) -> Vector3<f64> {
    let k = v.iamax();
    Vector3::ith(k, v[k].signum())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_take_directions_where_they_should() {
        let (a, b) = (Vector3::new(0.3, -1.0, 0.2), Vector3::new(0.1, 0.4, 2.0));
        assert!((swing(&a, &b) * a.normalize() - b.normalize()).norm() < 1e-12);
        assert!((swing(&a, &-a) * a + a).norm() < 1e-9);
        assert_eq!(swing(&a, &Vector3::zeros()), UnitQuaternion::identity());
        let turned = align([&Vector3::x(), &Vector3::y()], [&a, &b]);
        assert!((turned * Vector3::x() - a.normalize()).norm() < 1e-12);
        assert!((turned * Vector3::y()).dot(&b) > 0.0);
        assert_eq!(nearest_axis(&a), -Vector3::y());
    }
}
