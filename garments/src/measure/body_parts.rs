//! Coarse parts of the body, found from skin weights.

use serde::{Deserialize, Serialize};
use toile_character::{Joint, SkinWeights, joint::JOINTS};

/// Number of coarse parts.
pub const PART_COUNT: usize = 10;

/// A coarse part of the body; left and right are one part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[repr(u8)]
#[allow(missing_docs)] // the names are the documentation
pub enum BodyPart {
    Head,
    Neck,
    Torso,
    Pelvis,
    UpperArm,
    LowerArm,
    Hand,
    UpperLeg,
    LowerLeg,
    Foot,
}

/// The part that a joint moves.
pub fn part_of(joint: Joint) -> BodyPart {
    use Joint as J;
    match joint {
        J::Hips => BodyPart::Pelvis,
        J::Spine | J::Chest | J::UpperChest | J::LeftShoulder | J::RightShoulder => BodyPart::Torso,
        J::Neck => BodyPart::Neck,
        J::Head => BodyPart::Head,
        J::LeftUpperArm | J::RightUpperArm => BodyPart::UpperArm,
        J::LeftLowerArm | J::RightLowerArm => BodyPart::LowerArm,
        J::LeftUpperLeg | J::RightUpperLeg => BodyPart::UpperLeg,
        J::LeftLowerLeg | J::RightLowerLeg => BodyPart::LowerLeg,
        J::LeftFoot | J::RightFoot | J::LeftToes | J::RightToes => BodyPart::Foot,
        _ => BodyPart::Hand,
    }
}

/// Share of each part in every body vertex; the shares of a vertex sum to 1.
pub fn part_shares(weights: &SkinWeights) -> Vec<[f32; PART_COUNT]> {
    (0..weights.len())
        .map(|v| {
            let mut shares = [0.0; PART_COUNT];
            for (joint, w) in weights.of(v) {
                let part = JOINTS.get(joint as usize).map_or(BodyPart::Torso, |&j| part_of(j));
                shares[part as usize] += w;
            }
            shares
        })
        .collect()
}
