//! Two bones bent so that the second ends at a given point.

use nalgebra::{UnitQuaternion, Vector3};
use toile_geometry::direction::{frame, unit_or};

/// World rotations of an upper and a lower bone, both along -y at rest, of lengths `upper` and `lower`, that start
/// at the origin and end at `target`, bent towards `pole`. A target out of reach is pointed at.
pub fn bend(
    target: &Vector3<f64>,
    upper: f64,
    lower: f64,
    pole: &Vector3<f64>,
) -> (UnitQuaternion<f64>, UnitQuaternion<f64>) {
    let along = unit_or(target, &-Vector3::y());
    let side = unit_or(&(pole - along * along.dot(pole)), &Vector3::z());
    let (middle, reach) = middle_joint(&along, target.norm(), &side, upper, lower);
    let end = along * reach;
    (turned(&middle, &side), turned(&(end - middle), &side))
}

/// Where the middle joint of two bones is, from their start, when their end is `distance` along the unit vector `along`
/// and they bend towards the unit vector `side`; and that distance, clamped to what the bones reach.
pub fn middle_joint(
    along: &Vector3<f64>,
    distance: f64,
    side: &Vector3<f64>,
    upper: f64,
    lower: f64,
) -> (Vector3<f64>, f64) {
    let reach = distance.clamp((upper - lower).abs() + 1e-6, upper + lower);
    // Law of cosines: the middle joint's foot on the line from start to end.
    let foot = (upper * upper - lower * lower + reach * reach) / (2.0 * reach);
    (along * foot + side * (upper * upper - foot * foot).max(0.0).sqrt(), reach)
}

/// The rotation that takes -y to `bone` and +z near to `front`.
fn turned(bone: &Vector3<f64>, front: &Vector3<f64>) -> UnitQuaternion<f64> {
    frame(bone, front) * frame(&-Vector3::y(), &Vector3::z()).inverse()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_end_is_reached_with_the_knee_in_front() {
        for target in [Vector3::new(0.1, -0.6, 0.2), Vector3::new(-0.2, -0.75, -0.1)] {
            let (a, b) = bend(&target, 0.42, 0.39, &Vector3::z());
            let knee = a * -Vector3::y() * 0.42;
            assert!((knee + b * -Vector3::y() * 0.39 - target).norm() < 1e-9);
            let line = target * (knee.dot(&target) / target.norm_squared());
            assert!((knee - line).z > 0.0);
        }
        let (a, b) = bend(&Vector3::new(0.0, -2.0, 0.0), 0.42, 0.39, &Vector3::z());
        assert!(a.angle() < 1e-6 && b.angle() < 1e-6);
    }
}
