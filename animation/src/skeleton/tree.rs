//! The hierarchy of a motion file with its names taken apart.

use toile_character::Joint;

use super::{
    joint_names::{CLAVICLE, FOOT, HAND, HEAD, JointName, LOWER_ARM, LOWER_LEG, Side, TOES, UPPER_ARM, UPPER_LEG},
    prefix,
    source::{Source, Tip},
};
use crate::{AnimationError, Bvh};

/// The joint on `side` that answers to `left` on the left.
pub(super) fn on_side(left: Joint, side: Side) -> Joint {
    if side == Side::Right { left.mirrored() } else { left }
}

/// The hierarchy with its names taken apart.
pub(super) struct Tree<'a> {
    bvh: &'a Bvh,
    names: Vec<JointName>,
    depths: Vec<usize>,
}

impl<'a> Tree<'a> {
    pub fn new(bvh: &'a Bvh) -> Self {
        let written: Vec<&str> = bvh.joints.iter().map(|j| j.name.as_str()).collect();
        let prefix = prefix::common(&written);
        let names = written.iter().map(|n| JointName::parse(n.strip_prefix(prefix).unwrap_or(n))).collect();
        let mut depths: Vec<usize> = Vec::with_capacity(bvh.joints.len());
        for joint in &bvh.joints {
            depths.push(joint.parent.map_or(0, |p| depths[p] + 1));
        }
        Self { bvh, names, depths }
    }

    pub fn unknown(&self, missing: &str) -> AnimationError {
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
    pub fn limbs_of(&self, side: Side) -> [(Joint, Option<usize>); 8] {
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
    pub fn fingers_of(&self, side: Side, limbs: &mut [Option<usize>]) {
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

    pub fn head(&self) -> Option<usize> {
        HEAD.iter().find_map(|alias| {
            (0..self.names.len())
                .filter(|&i| self.names[i].part == *alias && self.names[i].side == Side::Middle)
                .min_by_key(|&i| (self.depths[i], i))
        })
    }

    pub fn is_below(&self, joint: usize, ancestor: usize) -> bool {
        let mut at = self.bvh.joints[joint].parent;
        while let Some(i) = at {
            if i == ancestor {
                return true;
            }
            at = self.bvh.joints[i].parent;
        }
        false
    }

    pub fn common_ancestor(&self, a: usize, b: usize) -> usize {
        let (mut a, mut b) = (a, b);
        while a != b {
            let deeper = if self.depths[a] >= self.depths[b] { &mut a } else { &mut b };
            *deeper = self.bvh.joints[*deeper].parent.unwrap_or(0);
        }
        a
    }

    /// The joints from below `ancestor` down to `joint`.
    pub fn path(&self, ancestor: usize, joint: usize) -> Vec<usize> {
        let mut path = Vec::new();
        let mut at = Some(joint);
        while let Some(i) = at.filter(|i| *i != ancestor) {
            path.push(i);
            at = self.bvh.joints[i].parent;
        }
        path.reverse();
        path
    }

    pub fn find_tips(&self, source: &mut Source) {
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
