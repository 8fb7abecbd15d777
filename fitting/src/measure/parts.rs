//! Which triangles of the template a tape may touch.
//!
//! A tape around the trunk leaves the arms out, and a tape around one leg leaves the other leg out, because their
//! triangles belong to other parts of the template: no distance decides, so arms that touch the trunk and thighs that
//! touch each other change nothing.

use toile_character::{BodyModel, Region};

/// Vertices of the mean body this near to its middle plane belong to both halves, metres: the template's middle seam.
const SEAM: f32 = 0.002;

/// Left or right half of the body, as the person sees it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    Left,
    Right,
}

impl Side {
    pub const BOTH: [Self; 2] = [Self::Left, Self::Right];

    /// As names of landmarks, joints and measurements begin.
    pub fn word(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
        }
    }

    /// 1 on the left (+X), −1 on the right.
    pub fn sign(self) -> f64 {
        match self {
            Self::Left => 1.0,
            Self::Right => -1.0,
        }
    }
}

/// Triangles of the template's outside by the part of the body that a tape lies on; the pockets of mouth and eyes are
/// left out.
#[derive(Debug)]
pub(crate) struct Parts {
    /// Trunk and both legs, without arms, head and feet.
    pub trunk: Vec<[u32; 3]>,
    /// Trunk, neck and head, without limbs.
    pub head_and_neck: Vec<[u32; 3]>,
    /// Arm and hand, left and right.
    arms: [Vec<[u32; 3]>; 2],
    /// Leg, foot and the half of the trunk above, left and right.
    legs: [Vec<[u32; 3]>; 2],
}

impl Parts {
    /// Sorts the template's triangles.
    pub fn new(model: &BodyModel) -> Self {
        use Region::*;
        let within = |regions: &[Region], side: Option<Side>| -> Vec<[u32; 3]> {
            let is_in = |v: u32| {
                let v = v as usize;
                let in_half = side.is_none_or(|s| s.sign() as f32 * model.mean[v].x > -SEAM);
                in_half && !model.inner[v] && regions.contains(&model.regions[v])
            };
            model.triangles.iter().filter(|t| t.iter().all(|&v| is_in(v))).copied().collect()
        };
        Self {
            trunk: within(&[Torso, LeftLeg, RightLeg], None),
            head_and_neck: within(&[Torso, Head], None),
            arms: [within(&[LeftArm, LeftHand], None), within(&[RightArm, RightHand], None)],
            legs: [
                within(&[Torso, LeftLeg, LeftFoot], Some(Side::Left)),
                within(&[Torso, RightLeg, RightFoot], Some(Side::Right)),
            ],
        }
    }

    pub fn arm(&self, side: Side) -> &[[u32; 3]] {
        &self.arms[side as usize]
    }

    pub fn leg(&self, side: Side) -> &[[u32; 3]] {
        &self.legs[side as usize]
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    #[test]
    fn a_part_holds_nothing_of_another_limb() {
        let model = BodyModel::load_default().unwrap();
        let parts = Parts::new(&model);
        let regions = |triangles: &[[u32; 3]]| -> HashSet<Region> {
            triangles.iter().flatten().map(|&v| model.regions[v as usize]).collect()
        };
        assert!(parts.head_and_neck.iter().flatten().all(|&v| !model.inner[v as usize]));
        assert!(!regions(&parts.trunk).contains(&Region::LeftArm));
        assert!(!regions(parts.leg(Side::Left)).contains(&Region::RightLeg));
        assert_eq!(regions(parts.arm(Side::Right)), HashSet::from([Region::RightArm, Region::RightHand]));
        for side in Side::BOTH {
            let across = parts.leg(side).iter().flatten().map(|&v| side.sign() as f32 * model.mean[v as usize].x);
            assert!(across.fold(f32::MAX, f32::min) > -SEAM);
        }
    }
}
