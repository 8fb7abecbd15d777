//! The parts of the body that template vertices belong to.

use serde::{Deserialize, Serialize};

/// The part of the body that a template vertex belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[repr(u8)]
#[allow(missing_docs)] // the names are the documentation
pub enum Region {
    Torso,
    LeftArm,
    RightArm,
    LeftLeg,
    RightLeg,
    LeftHand,
    RightHand,
    LeftFoot,
    RightFoot,
    Head,
}

impl Region {
    /// All regions; the position is the asset's code.
    pub const ALL: [Self; 10] = [
        Self::Torso,
        Self::LeftArm,
        Self::RightArm,
        Self::LeftLeg,
        Self::RightLeg,
        Self::LeftHand,
        Self::RightHand,
        Self::LeftFoot,
        Self::RightFoot,
        Self::Head,
    ];

    /// The region with this code.
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.get(usize::from(code)).copied()
    }

    /// In words, such as `left hand`.
    pub fn words(self) -> &'static str {
        match self {
            Self::Torso => "torso",
            Self::LeftArm => "left arm",
            Self::RightArm => "right arm",
            Self::LeftLeg => "left leg",
            Self::RightLeg => "right leg",
            Self::LeftHand => "left hand",
            Self::RightHand => "right hand",
            Self::LeftFoot => "left foot",
            Self::RightFoot => "right foot",
            Self::Head => "head",
        }
    }

    /// True for hands, feet and head: thin or detailed, and left out where bodies are scored.
    pub fn is_extremity(self) -> bool {
        use Region::*;
        matches!(self, LeftHand | RightHand | LeftFoot | RightFoot | Head)
    }
}
