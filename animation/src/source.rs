//! The joints of a motion file recognised: limbs by name, the trunk by structure.

use nalgebra::{Isometry3, Point3};
use toile_character::Joint;

use crate::{
    AnimationError,
    bvh::Bvh,
    joint_names::{CLAVICLE, FOOT, HAND, HEAD, JointName, LOWER_ARM, LOWER_LEG, Side, TOES, UPPER_ARM, UPPER_LEG},
};

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
    limbs: Vec<Option<usize>>,
    /// What a joint points at: a joint below it, or its End Site.
    tips: Vec<Option<Tip>>,
}

#[derive(Debug, Clone, PartialEq)]
enum Tip {
    /// The middle of these joints.
    Joints(Vec<usize>),
    EndSite(usize),
}

impl Source {
    /// The joint that moves `joint`, for limbs.
    pub fn limb(&self, joint: Joint) -> Option<usize> {
        self.limbs[joint.index()]
    }

    /// The joint of a limb that must be there (see [`recognise`]).
    fn required(&self, joint: Joint) -> usize {
        self.limb(joint).unwrap_or(self.pelvis)
    }

    /// Where limb joint `joint` is when the file's joints stand at `world`.
    pub fn position(&self, joint: Joint, world: &[Isometry3<f64>]) -> Point3<f64> {
        Point3::from(world[self.required(joint)].translation.vector)
    }

    /// What limb joint `joint` points at, when the file's joints stand at `world`.
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

/// Finds the joints of a person in `bvh`.
///
/// # Errors
/// [`AnimationError::UnknownSkeleton`] names what is needed and what was found.
pub(crate) fn recognise(bvh: &Bvh) -> Result<Source, AnimationError> {
    let tree = Tree::new(bvh);
    let mut limbs = vec![None; toile_character::JOINT_COUNT];
    for side in [Side::Left, Side::Right] {
        for (joint, found) in tree.limbs_of(side) {
            limbs[on_side(joint, side).index()] = found;
        }
        tree.fingers_of(side, &mut limbs);
    }
    let missing = |what: &str| tree.unknown(what);
    let chains = [
        (Joint::LeftUpperLeg, Joint::LeftLowerLeg, "upper leg with a lower leg below it"),
        (Joint::LeftUpperArm, Joint::LeftLowerArm, "upper arm with a lower arm below it"),
    ];
    for (upper, lower, what) in chains {
        for (upper, lower, side) in [(upper, lower, "left"), (upper.mirrored(), lower.mirrored(), "right")] {
            match (limbs[upper.index()], limbs[lower.index()]) {
                (Some(u), Some(l)) if u != l && tree.is_below(l, u) => {}
                _ => return Err(missing(&format!("{side} {what}"))),
            }
        }
    }
    let required = |joint: Joint| limbs[joint.index()].unwrap_or(0);
    let pelvis = tree.common_ancestor(required(Joint::LeftUpperLeg), required(Joint::RightUpperLeg));
    let chest = tree.common_ancestor(required(Joint::LeftUpperArm), required(Joint::RightUpperArm));
    let waist = tree.common_ancestor(pelvis, chest);
    let spine = tree.path(waist, chest);
    if spine.is_empty() {
        return Err(missing("spine joint between legs and arms"));
    }
    let head = tree.head();
    let neck = head.map_or(Vec::new(), |head| {
        let mut path = tree.path(tree.common_ancestor(chest, head), head);
        path.pop();
        path
    });
    let mut source = Source { pelvis, spine, neck, head, tips: vec![None; limbs.len()], limbs };
    tree.find_tips(&mut source);
    for (joint, side) in [(Joint::LeftLowerLeg, "left"), (Joint::RightLowerLeg, "right")] {
        if source.tips[joint.index()].is_none() {
            return Err(missing(&format!("{side} foot")));
        }
    }
    Ok(source)
}

fn on_side(left: Joint, side: Side) -> Joint {
    if side == Side::Right { left.mirrored() } else { left }
}

/// The hierarchy with its names taken apart.
struct Tree<'a> {
    bvh: &'a Bvh,
    names: Vec<JointName>,
    depths: Vec<usize>,
}

impl<'a> Tree<'a> {
    fn new(bvh: &'a Bvh) -> Self {
        let names = bvh.joints.iter().map(|j| JointName::parse(&j.name)).collect();
        let mut depths: Vec<usize> = Vec::with_capacity(bvh.joints.len());
        for joint in &bvh.joints {
            depths.push(joint.parent.map_or(0, |p| depths[p] + 1));
        }
        Self { bvh, names, depths }
    }

    fn unknown(&self, missing: &str) -> AnimationError {
        const SHOWN: usize = 24;
        let mut found: Vec<&str> = self.bvh.joints.iter().take(SHOWN).map(|j| j.name.as_str()).collect();
        let more = format!("and {} more", self.bvh.joints.len().saturating_sub(SHOWN));
        if self.bvh.joints.len() > SHOWN {
            found.push(&more);
        }
        AnimationError::UnknownSkeleton { missing: missing.into(), found: found.join(", ") }
    }

    /// The joint of the first alias that is there: of several the lowest number (a twist joint follows its bone),
    /// then the deepest (a helper goes before its joint).
    fn find(&self, side: Side, aliases: &[&str], taken: &[Option<usize>]) -> Option<usize> {
        aliases.iter().find_map(|alias| {
            let matching = (0..self.names.len())
                .filter(|&i| self.names[i].side == side && self.names[i].part == *alias && !taken.contains(&Some(i)));
            let lowest = matching.clone().map(|i| &self.names[i].numbers).min()?;
            matching.filter(|&i| self.names[i].numbers == *lowest).max_by_key(|&i| (self.depths[i], i))
        })
    }

    /// Limb joints of one side, under the names of the left.
    fn limbs_of(&self, side: Side) -> [(Joint, Option<usize>); 8] {
        let upper_leg = self.find(side, UPPER_LEG, &[]);
        let lower_leg = self.find(side, LOWER_LEG, &[upper_leg]);
        let foot = self.find(side, FOOT, &[]);
        let toes = self.find(side, TOES, &[foot]).filter(|t| foot.is_some_and(|f| self.is_below(*t, f)));
        let upper_arm = self.find(side, UPPER_ARM, &[]);
        let lower_arm = self.find(side, LOWER_ARM, &[upper_arm]);
        let hand = self.find(side, HAND, &[]);
        let clavicle = self.find(side, CLAVICLE, &[upper_arm]);
        [
            (Joint::LeftUpperLeg, upper_leg),
            (Joint::LeftLowerLeg, lower_leg),
            (Joint::LeftFoot, foot.filter(|f| lower_leg.is_some_and(|l| self.is_below(*f, l)))),
            (Joint::LeftToes, toes),
            (Joint::LeftShoulder, clavicle.filter(|c| upper_arm.is_some_and(|u| self.is_below(u, *c)))),
            (Joint::LeftUpperArm, upper_arm),
            (Joint::LeftLowerArm, lower_arm),
            (Joint::LeftHand, hand.filter(|h| lower_arm.is_some_and(|l| self.is_below(*h, l)))),
        ]
    }

    /// Fingers with at least two segments below the hand.
    fn fingers_of(&self, side: Side, limbs: &mut [Option<usize>]) {
        let Some(hand) = limbs[on_side(Joint::LeftHand, side).index()] else { return };
        for finger in 0..5 {
            let mut segments: Vec<(u32, usize)> = Vec::new();
            for i in (0..self.names.len()).filter(|&i| self.is_below(i, hand)) {
                let Some((of, segment)) = self.names[i].finger() else { continue };
                if of != finger {
                    continue;
                }
                match segments.iter_mut().find(|s| s.0 == segment) {
                    Some(slot) if self.depths[i] > self.depths[slot.1] => slot.1 = i,
                    Some(_) => {}
                    None => segments.push((segment, i)),
                }
            }
            segments.sort_unstable();
            if segments.len() < 2 {
                continue;
            }
            let first = on_side(Joint::LeftThumbMetacarpal, side).index() + 3 * finger;
            for (k, (_, joint)) in segments.into_iter().take(3).enumerate() {
                limbs[first + k] = Some(joint);
            }
        }
    }

    fn head(&self) -> Option<usize> {
        HEAD.iter().find_map(|alias| {
            (0..self.names.len())
                .filter(|&i| self.names[i].part == *alias && self.names[i].side == Side::Middle)
                .min_by_key(|&i| (self.depths[i], i))
        })
    }

    fn is_below(&self, joint: usize, ancestor: usize) -> bool {
        let mut at = self.bvh.joints[joint].parent;
        while let Some(i) = at {
            if i == ancestor {
                return true;
            }
            at = self.bvh.joints[i].parent;
        }
        false
    }

    fn common_ancestor(&self, a: usize, b: usize) -> usize {
        let (mut a, mut b) = (a, b);
        while a != b {
            let deeper = if self.depths[a] >= self.depths[b] { &mut a } else { &mut b };
            *deeper = self.bvh.joints[*deeper].parent.unwrap_or(0);
        }
        a
    }

    /// The joints from below `ancestor` down to `joint`.
    fn path(&self, ancestor: usize, joint: usize) -> Vec<usize> {
        let mut path = Vec::new();
        let mut at = Some(joint);
        while let Some(i) = at.filter(|i| *i != ancestor) {
            path.push(i);
            at = self.bvh.joints[i].parent;
        }
        path.reverse();
        path
    }

    fn find_tips(&self, source: &mut Source) {
        use Joint::*;
        let next = [(LeftUpperLeg, LeftLowerLeg), (LeftUpperArm, LeftLowerArm), (LeftLowerArm, LeftHand)];
        for (joint, child) in next.into_iter().chain([(LeftLowerLeg, LeftFoot)]) {
            for (joint, child) in [(joint, child), (joint.mirrored(), child.mirrored())] {
                let below = source.limb(joint).and_then(|j| self.tip_below(j));
                source.tips[joint.index()] = source.limb(child).map(|c| Tip::Joints(vec![c])).or(below);
            }
        }
        for joint in toile_character::joint::JOINTS {
            if matches!(joint, LeftFoot | RightFoot) {
                source.tips[joint.index()] = source.limb(joint).and_then(|j| self.tip_of_foot(j));
            } else if source.tips[joint.index()].is_none() {
                source.tips[joint.index()] = source.limb(joint).and_then(|j| self.tip_below(j));
            }
        }
    }

    /// The middle of the toes that a foot carries first, else whatever is below it.
    fn tip_of_foot(&self, foot: usize) -> Option<Tip> {
        let is_toe = |i: &usize| self.names[*i].part.starts_with("toe") || self.names[*i].part == "ball";
        let toes: Vec<usize> = (0..self.names.len()).filter(|&i| self.is_below(i, foot)).filter(is_toe).collect();
        let first = toes.iter().map(|&i| self.depths[i]).min();
        match first {
            Some(depth) => Some(Tip::Joints(toes.into_iter().filter(|&i| self.depths[i] == depth).collect())),
            None => self.tip_below(foot),
        }
    }

    /// The nearest thing below a joint that is not in the same place; middle fingers first, thumbs never.
    fn tip_below(&self, joint: usize) -> Option<Tip> {
        let apart = |offset: &nalgebra::Vector3<f64>| offset.norm() > 1e-9;
        let children = || (0..self.bvh.joints.len()).filter(|&i| self.bvh.joints[i].parent == Some(joint));
        let finger = |i: usize| self.names[i].finger().map(|f| f.0);
        let mut candidates: Vec<usize> = children().filter(|&i| finger(i) != Some(0)).collect();
        candidates.sort_by_key(|&i| (finger(i) != Some(2), i));
        for i in candidates {
            if apart(&self.bvh.joints[i].offset) {
                return Some(Tip::Joints(vec![i]));
            }
            if let Some(tip) = self.tip_below(i) {
                return Some(tip);
            }
        }
        self.bvh.joints[joint].end_site.filter(apart).map(|_| Tip::EndSite(joint))
    }
}
