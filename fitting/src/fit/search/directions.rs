//! The poses that an arm or a leg is tried in: what its joints can do, some 30° apart.

use nalgebra::{UnitQuaternion, Vector3};
use toile_character::{Joint, Skeleton};

/// A limb: three joints, and the rotations of the first two that are tried.
pub(super) struct Limb {
    pub root: Joint,
    pub middle: Joint,
    pub end: Joint,
    /// +1 on the left.
    pub side: f64,
    is_arm: bool,
}

pub(super) const LIMBS: [Limb; 4] = [
    limb(Joint::LeftUpperLeg, Joint::LeftLowerLeg, Joint::LeftFoot, 1.0, false),
    limb(Joint::RightUpperLeg, Joint::RightLowerLeg, Joint::RightFoot, -1.0, false),
    limb(Joint::LeftUpperArm, Joint::LeftLowerArm, Joint::LeftHand, 1.0, true),
    limb(Joint::RightUpperArm, Joint::RightLowerArm, Joint::RightHand, -1.0, true),
];

const fn limb(root: Joint, middle: Joint, end: Joint, side: f64, is_arm: bool) -> Limb {
    Limb { root, middle, end, side, is_arm }
}

/// Directions of an upper arm: elevations, and swings from straight out (0) to the front (90) and across it, degrees.
const ARM_ELEVATIONS: [f64; 7] = [-80.0, -55.0, -30.0, -5.0, 20.0, 45.0, 75.0];
const ARM_SWINGS: [f64; 7] = [-70.0, -35.0, 0.0, 30.0, 60.0, 90.0, 120.0];
/// Turns about itself, and bends of the elbow, degrees.
const ARM_TWISTS: [f64; 6] = [-90.0, -50.0, -15.0, 20.0, 60.0, 100.0];
const ELBOWS: [f64; 4] = [10.0, 50.0, 90.0, 130.0];
/// Of a thigh: lifts to the front, and to the side, degrees.
const LEG_LIFTS: [f64; 8] = [-50.0, -25.0, 0.0, 25.0, 50.0, 75.0, 100.0, 125.0];
const LEG_SPREADS: [f64; 6] = [-20.0, 0.0, 20.0, 40.0, 60.0, 80.0];
const LEG_TWISTS: [f64; 3] = [-35.0, 0.0, 35.0];
const KNEES: [f64; 5] = [3.0, 35.0, 70.0, 105.0, 140.0];
/// Below this bend a turn about the limb's axis changes little, degrees.
const STRAIGHT: f64 = 20.0;

impl Limb {
    /// Rotations of root and middle joint.
    pub fn rotations(&self, skeleton: &Skeleton) -> Vec<[UnitQuaternion<f64>; 2]> {
        let bone = |from: Joint, to: Joint| {
            (skeleton.position(to) - skeleton.position(from)).try_normalize(1e-9).unwrap_or(-Vector3::y())
        };
        let (upper, lower) = (bone(self.root, self.middle), bone(self.middle, self.end));
        let (twists, bends): (&[f64], &[f64]) =
            if self.is_arm { (&ARM_TWISTS, &ELBOWS) } else { (&LEG_TWISTS, &KNEES) };
        let hinge = if self.is_arm { lower.cross(&Vector3::z()) } else { Vector3::x() };
        let hinge = hinge.try_normalize(1e-9).unwrap_or_else(Vector3::x);
        let mut out = Vec::new();
        for direction in self.directions() {
            let raise = UnitQuaternion::rotation_between(&upper, &direction).unwrap_or_default();
            for &bend in bends {
                let middle = UnitQuaternion::from_scaled_axis(hinge * bend.to_radians());
                let twists = if bend < STRAIGHT { &[0.0] } else { twists };
                for twist in twists {
                    let turn = UnitQuaternion::from_scaled_axis(upper * (self.side * twist).to_radians());
                    out.push([raise * turn, middle]);
                }
            }
        }
        out
    }

    fn directions(&self) -> Vec<Vector3<f64>> {
        let mut out = Vec::new();
        if self.is_arm {
            for elevation in ARM_ELEVATIONS.map(f64::to_radians) {
                for swing in ARM_SWINGS.map(f64::to_radians) {
                    let level = elevation.cos();
                    out.push(Vector3::new(self.side * level * swing.cos(), elevation.sin(), level * swing.sin()));
                }
            }
        } else {
            for lift in LEG_LIFTS.map(f64::to_radians) {
                for spread in LEG_SPREADS.map(f64::to_radians) {
                    let down = spread.cos();
                    out.push(Vector3::new(self.side * spread.sin(), -down * lift.cos(), down * lift.sin()));
                }
            }
        }
        out
    }
}
