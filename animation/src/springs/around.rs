//! Places around the legs: an angle and a height.

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};
use toile_character::Joint;

use super::layer::RestedLayer;

/// Chains around the body: cloth between two of them, 105 mm apart where a skirt has a radius of 0.2 m, bows by 7 mm over its chord.
pub(super) const CHAINS: usize = 12;

/// A vertical axis between the legs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Around {
    /// Where it is on the floor.
    axis: Point3<f64>,
    /// Height of the hips' joints: what hangs begins to swing here, metres.
    pub top: f64,
    /// Height of the lower of the two ankles, metres.
    pub floor: f64,
}

impl Around {
    /// The axis amid the cloth that hangs below the hips; `None` where nothing does.
    pub fn new(joints: &[Point3<f64>], layers: &[RestedLayer<'_>]) -> Option<Self> {
        let at = |joint: Joint| joints[joint.index()];
        let hips = nalgebra::center(&at(Joint::LeftUpperLeg), &at(Joint::RightUpperLeg));
        let below = layers[1..].iter().filter(|l| l.may_hang).flat_map(|l| &l.mesh.positions);
        let depths = below.map(|p| p.cast::<f64>()).filter(|p| p.y < hips.y).map(|p| p.z);
        let (near, far) = depths.fold((f64::MAX, f64::MIN), |(near, far), z| (near.min(z), far.max(z)));
        if near > far {
            return None;
        }
        let floor = at(Joint::LeftFoot).y.min(at(Joint::RightFoot).y);
        Some(Self { axis: Point3::new(hips.x, 0.0, 0.5 * (near + far)), top: hips.y, floor })
    }

    /// The angle of `p`, in chains: 0 in front, growing to the left, below [`CHAINS`]; and its distance from the axis, metres.
    pub fn polar(&self, p: &Point3<f64>) -> (f64, f64) {
        let from = p - self.axis;
        let turn = from.x.atan2(from.z).rem_euclid(TAU) / TAU * CHAINS as f64;
        (turn % CHAINS as f64, from.x.hypot(from.z))
    }

    /// The place at an angle (in chains), a distance from the axis and a height.
    pub fn place(&self, turn: f64, radius: f64, height: f64) -> Point3<f64> {
        let angle = turn / CHAINS as f64 * TAU;
        Point3::new(self.axis.x, height, self.axis.z) + Vector3::new(angle.sin(), 0.0, angle.cos()) * radius
    }
}

/// The two chains beside an angle, and the share of the second.
pub(super) fn beside(turn: f64) -> ([usize; 2], f64) {
    let first = turn.floor() as usize % CHAINS;
    ([first, (first + 1) % CHAINS], turn - turn.floor())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_and_places_are_inverse() {
        let around = Around { axis: Point3::new(0.1, 0.0, -0.02), top: 0.9, floor: 0.1 };
        for k in 0..50 {
            let turn = f64::from(k) * 0.2399 % CHAINS as f64;
            let (angle, radius) = around.polar(&around.place(turn, 0.3, 0.5));
            assert!((angle - turn).abs() < 1e-9 && (radius - 0.3).abs() < 1e-9, "{turn} {angle}");
        }
        assert!(around.polar(&Point3::new(0.1, 0.0, 1.0)).0 < 1e-9, "the front is 0");
        assert_eq!(beside(11.25), ([11, 0], 0.25));
    }
}
