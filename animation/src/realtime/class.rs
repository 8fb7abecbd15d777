//! The three classes into which cloth is divided from its distance to the skin at rest (Magnenat-Thalmann et al., §5.3.1).

use nalgebra::Vector3;
use toile_character::{Joint, SkinWeights, joint::JOINTS};

use crate::blend::anchors::{FAR, NEAR};

/// Share of free cloth from which a vertex floats.
const FREE: f32 = 0.5;

/// How a vertex is moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Class {
    /// Rides in the skin's local frame at a constant offset.
    Stretch,
    /// Loose cloth of a limb: a body of its own in a half-sphere on the skin.
    Limb,
    /// Loose cloth of the trunk: a particle of the rough mesh.
    Trunk,
    /// A particle of the rough mesh that meets whatever it can hit.
    Floating,
}

impl Class {
    /// Of a vertex at a `distance` from the skin, metres, of which the share `free` hangs free by the garment's kind, on a `limb` or not.
    pub fn of(distance: f32, free: f32, limb: bool) -> Self {
        if free > FREE || f64::from(distance) > FAR {
            Self::Floating
        } else if f64::from(distance) <= NEAR {
            Self::Stretch
        } else if limb {
            Self::Limb
        } else {
            Self::Trunk
        }
    }

    /// True where the vertex is a particle that others pull at.
    pub fn is_particle(self) -> bool {
        matches!(self, Self::Trunk | Self::Floating)
    }
}

/// How far cloth floats at a `distance` from the skin, metres, of which the share `free` hangs free: 0 on the skin, 1 where it hangs.
pub(super) fn floating(distance: f32, free: f32) -> f32 {
    ((distance - NEAR as f32) / (FAR - NEAR) as f32).max(free).clamp(0.0, 1.0)
}

/// True where an arm or a leg moves vertex `v` most.
pub(super) fn on_limb(weights: &SkinWeights, v: usize) -> bool {
    use Joint::*;
    let limbs = [
        LeftUpperArm,
        LeftLowerArm,
        LeftHand,
        RightUpperArm,
        RightLowerArm,
        RightHand,
        LeftUpperLeg,
        LeftLowerLeg,
        LeftFoot,
        RightUpperLeg,
        RightLowerLeg,
        RightFoot,
    ];
    JOINTS.get(usize::from(weights.joints[v][0])).is_some_and(|j| limbs.contains(j))
}

/// The half-sphere on the skin in which a vertex of a limb moves: its flat side lies on what is below, its middle is the foot of the
/// vertex.
///
/// Its radius depends on where the vertex lies to the skin's normal: straight over its foot, cloth can only come nearer than it was
/// scanned; the more it hangs aside, the farther can it swing, as the ball on the skin through its place is the larger.
#[derive(Debug, Clone, Copy)]
pub(super) struct HalfSphere {
    /// From the foot to the vertex at rest, metres.
    offset: Vector3<f32>,
    /// The skin's normal at rest.
    normal: Vector3<f32>,
    radius: f32,
    /// Height of the flat side over the foot, metres.
    floor: f32,
}

/// Widest half-sphere, in distances at rest.
const WIDEST: f32 = 1.5;

impl HalfSphere {
    /// For a vertex at `offset` from its foot on the skin, whose unit normal there is `normal`, over layers that reach up to `floor`
    /// metres.
    pub fn new(offset: Vector3<f32>, normal: Vector3<f32>, floor: f32) -> Self {
        let distance = offset.norm();
        let height = offset.dot(&normal);
        // The ball through the vertex that touches the skin in the foot has the diameter |o|² / height.
        let radius = if height > 0.0 { (distance * distance / height).min(WIDEST * distance) } else { distance };
        Self { offset, normal, radius, floor: floor.min(height) }
    }

    /// A displacement from the place at rest (in the skin's local frame, metres) that stays within the half-sphere.
    pub fn hold(&self, displacement: Vector3<f32>) -> Vector3<f32> {
        let mut at = self.offset + displacement;
        let below = self.floor - at.dot(&self.normal);
        if below > 0.0 {
            at += self.normal * below;
        }
        let distance = at.norm();
        if distance > self.radius {
            at *= self.radius / distance;
        }
        at - self.offset
    }
}
