//! Chains of joints that swing by themselves in programs that play avatars, as the VRM format describes them.

use nalgebra::Point3;

use crate::{Joint, SkinWeights};

/// Joints below the hips that swing as springs (VRM Consortium, VRMC_springBone-1.0), what they collide with, and the weights of the
/// layers that hang on them. Places are in metres in the pose that the avatar rests in, the T-pose of a VRM file.
#[derive(Debug, Clone, Default)]
pub struct SpringBones {
    /// The chains; joints are numbered behind the skeleton's 52, chain after chain, from a chain's root to its end.
    pub chains: Vec<SpringChain>,
    /// What no joint but a chain's first may come into.
    pub colliders: Vec<SpringCollider>,
    /// Share of its velocity that a joint loses in each update, 0 to 1.
    pub drag: f64,
    /// New skin weights of each layer of the avatar; `None` where those it has stay.
    pub weights: Vec<Option<SkinWeights>>,
}

/// A chain of joints, each a child of the one before it, the first a child of the hips.
#[derive(Debug, Clone, PartialEq)]
pub struct SpringChain {
    /// Name; joints are called after it, with a number.
    pub name: String,
    /// From the root to the end, which only says where the last bone ends; at least two.
    pub joints: Vec<SpringJoint>,
}

/// A joint of a chain: the root of a bone that ends at the next one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpringJoint {
    /// Where it rests.
    pub place: Point3<f64>,
    /// How far in a second the bone's end is drawn along the direction in which the bone rests, metres (the format's `stiffness`).
    pub stiffness: f64,
    /// Distance that the bone's end keeps from colliders, metres (the format's `hitRadius`).
    pub hit_radius: f64,
}

/// A capsule that moves with a joint of the skeleton.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpringCollider {
    /// The joint.
    pub joint: Joint,
    /// Ends of its axis.
    pub ends: [Point3<f64>; 2],
    /// Radius, metres.
    pub radius: f64,
}

impl SpringBones {
    /// Number of all chains' joints.
    pub fn joint_count(&self) -> usize {
        self.chains.iter().map(|c| c.joints.len()).sum()
    }
}

impl SpringCollider {
    /// Distance of `p` from its surface, metres; below 0 inside.
    pub fn distance(&self, p: &Point3<f64>) -> f64 {
        let [a, b] = self.ends;
        let axis = b - a;
        let along = if axis.norm_squared() > 0.0 { (p - a).dot(&axis) / axis.norm_squared() } else { 0.0 };
        (p - (a + axis * along.clamp(0.0, 1.0))).norm() - self.radius
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_capsule_is_round_at_its_ends() {
        let ends = [Point3::origin(), Point3::new(0.0, -1.0, 0.0)];
        let capsule = SpringCollider { joint: Joint::Hips, ends, radius: 0.1 };
        let at = |x, y| capsule.distance(&Point3::new(x, y, 0.0));
        assert!((at(0.3, -0.5) - 0.2).abs() < 1e-12 && (at(0.0, 0.4) - 0.3).abs() < 1e-12);
        assert!((at(0.3, -1.4) - 0.4).abs() < 1e-12 && at(0.0, -0.5) < 0.0);
        let ball = SpringCollider { ends: [ends[0]; 2], ..capsule };
        assert!((ball.distance(&ends[1]) - 0.9).abs() < 1e-12);
    }
}
