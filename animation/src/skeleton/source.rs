//! The joints of a motion file by their part in the body.

use nalgebra::{Isometry3, Point3};
use toile_character::Joint;

use crate::Bvh;

/// The joints of a BVH skeleton by their part in the body.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Source {
    /// The joint that carries both legs.
    pub pelvis: usize,
    /// The joints above the pelvis up to the one that carries the arms.
    pub spine: Vec<usize>,
    /// The joints between that one and the head.
    pub neck: Vec<usize>,
    /// The head, where there is one.
    pub head: Option<usize>,
    /// Joints of shoulders, arms, legs, hands, feet, fingers, by [`Joint::index`].
    pub(super) limbs: Vec<Option<usize>>,
    /// The tip of each joint: a joint below it, or its End Site.
    pub(super) tips: Vec<Option<Tip>>,
}

/// The tip of a joint: its bone points there.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Tip {
    /// The middle of these joints.
    Joints(Vec<usize>),
    EndSite(usize),
}

impl Source {
    /// The joint that moves `joint`, for limbs.
    pub fn limb(&self, joint: Joint) -> Option<usize> {
        self.limbs[joint.index()]
    }

    /// The joint of a limb that must be there (see `recognise`).
    fn required(&self, joint: Joint) -> usize {
        self.limb(joint).unwrap_or(self.pelvis)
    }

    /// Where limb joint `joint` is when the file's joints stand at `world`.
    pub fn position(&self, joint: Joint, world: &[Isometry3<f64>]) -> Point3<f64> {
        Point3::from(world[self.required(joint)].translation.vector)
    }

    /// The place that limb joint `joint` points at, when the file's joints stand at `world`.
    pub fn tip(&self, joint: Joint, bvh: &Bvh, world: &[Isometry3<f64>]) -> Option<Point3<f64>> {
        match self.tips[joint.index()].as_ref()? {
            Tip::EndSite(j) => bvh.joints[*j].end_position(&world[*j]),
            Tip::Joints(joints) => {
                let sum: nalgebra::Vector3<f64> = joints.iter().map(|j| world[*j].translation.vector).sum();
                Some(Point3::from(sum / joints.len() as f64))
            }
        }
    }

    /// Where the ankle of a lower leg is: its foot joint, or its End Site.
    pub fn ankle(&self, lower_leg: Joint, bvh: &Bvh, world: &[Isometry3<f64>]) -> Point3<f64> {
        self.tip(lower_leg, bvh, world).unwrap_or_else(|| self.position(lower_leg, world))
    }

    /// The file's names of all joints that were recognised, with the joint they move.
    pub fn named(&self, bvh: &Bvh) -> Vec<(Joint, String)> {
        let limbs = toile_character::joint::JOINTS.iter().filter_map(|&j| Some((j, self.limb(j)?)));
        let trunk = [(Joint::Hips, Some(self.pelvis)), (Joint::Spine, self.spine.first().copied())];
        let rest = [(Joint::UpperChest, self.spine.last().copied()), (Joint::Head, self.head)];
        let trunk = trunk.into_iter().chain(rest).filter_map(|(j, i)| Some((j, i?)));
        trunk.chain(limbs).map(|(j, i)| (j, bvh.joints[i].name.clone())).collect()
    }
}
