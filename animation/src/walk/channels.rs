//! The channel values of a BVH frame.

use nalgebra::{UnitQuaternion, Vector3};

use super::{
    moment::Moment,
    walker::{CENTIMETRES, SKELETON},
};

/// Channel values of one moment: hips position, then every joint's local rotation as z, x, y angles.
pub(super) fn channels(moment: &Moment, travel: f64) -> Vec<f64> {
    let position = (moment.hips + Vector3::z() * travel) * CENTIMETRES;
    let mut values = vec![position.x, position.y, position.z];
    for (index, (joint, ..)) in SKELETON.iter().enumerate() {
        let parent = SKELETON.iter().position(|s| Some(s.0) == joint.parent());
        let parent = parent.map_or_else(UnitQuaternion::identity, |p| moment.world[p]);
        values.extend(angles_zxy(&(parent.inverse() * moment.world[index])).map(f64::to_degrees));
    }
    values
}

/// Angles a, b, c with rotation = Rz(a)·Rx(b)·Ry(c), radians.
fn angles_zxy(rotation: &UnitQuaternion<f64>) -> [f64; 3] {
    let m = rotation.to_rotation_matrix();
    let x = m[(2, 1)].clamp(-1.0, 1.0).asin();
    if m[(2, 1)].abs() > 1.0 - 1e-12 {
        return [m[(1, 0)].atan2(m[(0, 0)]), x, 0.0];
    }
    [(-m[(0, 1)]).atan2(m[(1, 1)]), x, (-m[(2, 0)]).atan2(m[(2, 2)])]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::walk::moment::turn;

    #[test]
    fn angles_give_the_rotation_back() {
        for i in 0..200 {
            let t = f64::from(i);
            let r = UnitQuaternion::from_euler_angles((t * 0.7).sin() * 3.0, (t * 1.3).cos() * 1.5, t);
            let [a, b, c] = angles_zxy(&r);
            assert!((turn(2, a) * turn(0, b) * turn(1, c)).angle_to(&r) < 1e-6);
        }
    }
}
