//! Names of the joints in other systems.

use serde::{Deserialize, Serialize};

use crate::{Joint, joint::JOINTS};

/// A system of joint names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum JointNaming {
    /// VRM 1.0, as [`Joint::name`]: `leftUpperArm`.
    #[default]
    Vrm,
    /// H-Anim (ISO/IEC 19774-1:2019, annex A): `l_shoulder`.
    HAnim,
    /// Mixamo, which Unity, Unreal and Blender's add-ons map automatically: `mixamorig:LeftArm`.
    Mixamo,
}

/// VRM name without its side, H-Anim without `l_`, Mixamo without `mixamorig:Left`.
const NAMES: [[&str; 3]; 29] = [
    ["hips", "humanoid_root", "Hips"],
    ["spine", "vl5", "Spine"],
    ["chest", "vl1", "Spine1"],
    ["upperChest", "vt6", "Spine2"],
    ["neck", "vc4", "Neck"],
    ["head", "skullbase", "Head"],
    ["Shoulder", "sternoclavicular", "Shoulder"],
    ["UpperArm", "shoulder", "Arm"],
    ["LowerArm", "elbow", "ForeArm"],
    ["Hand", "radiocarpal", "Hand"],
    ["UpperLeg", "hip", "UpLeg"],
    ["LowerLeg", "knee", "Leg"],
    ["Foot", "talocrural", "Foot"],
    ["Toes", "metatarsophalangeal_2", "ToeBase"],
    ["ThumbMetacarpal", "carpometacarpal_1", "HandThumb1"],
    ["ThumbProximal", "metacarpophalangeal_1", "HandThumb2"],
    ["ThumbDistal", "carpal_interphalangeal_1", "HandThumb3"],
    ["IndexProximal", "metacarpophalangeal_2", "HandIndex1"],
    ["IndexIntermediate", "carpal_proximal_interphalangeal_2", "HandIndex2"],
    ["IndexDistal", "carpal_distal_interphalangeal_2", "HandIndex3"],
    ["MiddleProximal", "metacarpophalangeal_3", "HandMiddle1"],
    ["MiddleIntermediate", "carpal_proximal_interphalangeal_3", "HandMiddle2"],
    ["MiddleDistal", "carpal_distal_interphalangeal_3", "HandMiddle3"],
    ["RingProximal", "metacarpophalangeal_4", "HandRing1"],
    ["RingIntermediate", "carpal_proximal_interphalangeal_4", "HandRing2"],
    ["RingDistal", "carpal_distal_interphalangeal_4", "HandRing3"],
    ["LittleProximal", "metacarpophalangeal_5", "HandPinky1"],
    ["LittleIntermediate", "carpal_proximal_interphalangeal_5", "HandPinky2"],
    ["LittleDistal", "carpal_distal_interphalangeal_5", "HandPinky3"],
];

impl JointNaming {
    /// All systems.
    pub const ALL: [Self; 3] = [Self::Vrm, Self::HAnim, Self::Mixamo];

    /// The name of a joint.
    pub fn name(self, joint: Joint) -> String {
        let name = joint.name();
        let sides = [("left", "l_", "Left"), ("right", "r_", "Right"), ("", "", "")];
        let with_side = sides.iter().find_map(|side| Some((side, name.strip_prefix(side.0)?)));
        let ((_, hanim, mixamo), part) = with_side.unwrap_or((&sides[2], name));
        let [_, of_hanim, of_mixamo] = NAMES.iter().find(|n| n[0] == part).copied().unwrap_or_default();
        match self {
            Self::Vrm => name.into(),
            Self::HAnim => format!("{hanim}{of_hanim}"),
            Self::Mixamo => format!("mixamorig:{mixamo}{of_mixamo}"),
        }
    }

    /// The joint with a name.
    pub fn joint(self, name: &str) -> Option<Joint> {
        JOINTS.into_iter().find(|joint| self.name(*joint) == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_joint_has_a_name_of_its_own_in_each_system() {
        for naming in JointNaming::ALL {
            for joint in JOINTS {
                assert_eq!(naming.joint(&naming.name(joint)), Some(joint), "{joint:?} in {naming:?}");
            }
        }
    }

    #[test]
    fn well_known_names() {
        for (joint, hanim, mixamo) in [
            (Joint::Hips, "humanoid_root", "mixamorig:Hips"),
            (Joint::LeftUpperArm, "l_shoulder", "mixamorig:LeftArm"),
            (Joint::RightLowerLeg, "r_knee", "mixamorig:RightLeg"),
            (Joint::RightLittleDistal, "r_carpal_distal_interphalangeal_5", "mixamorig:RightHandPinky3"),
        ] {
            assert_eq!(JointNaming::HAnim.name(joint), hanim);
            assert_eq!(JointNaming::Mixamo.name(joint), mixamo);
        }
    }
}
