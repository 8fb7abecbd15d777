//! The 52 joints of a humanoid, named as VRM 1.0 names its bones (eyes and jaw left out).

use serde::{Deserialize, Serialize};

/// Number of joints of a skeleton.
pub const JOINT_COUNT: usize = 52;

macro_rules! joints {
    ($($name:ident),+ $(,)?) => {
        /// A joint of the humanoid skeleton; its discriminant is its index. Parents come before their children.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
        #[serde(rename_all = "camelCase")]
        #[repr(u8)]
        #[allow(missing_docs)] // the names are the documentation
        pub enum Joint {
            $($name),+
        }

        /// All joints in index order.
        pub const JOINTS: [Joint; JOINT_COUNT] = [$(Joint::$name),+];
    };
}

joints!(
    Hips,
    Spine,
    Chest,
    UpperChest,
    Neck,
    Head,
    LeftShoulder,
    LeftUpperArm,
    LeftLowerArm,
    LeftHand,
    LeftUpperLeg,
    LeftLowerLeg,
    LeftFoot,
    LeftToes,
    RightShoulder,
    RightUpperArm,
    RightLowerArm,
    RightHand,
    RightUpperLeg,
    RightLowerLeg,
    RightFoot,
    RightToes,
    LeftThumbMetacarpal,
    LeftThumbProximal,
    LeftThumbDistal,
    LeftIndexProximal,
    LeftIndexIntermediate,
    LeftIndexDistal,
    LeftMiddleProximal,
    LeftMiddleIntermediate,
    LeftMiddleDistal,
    LeftRingProximal,
    LeftRingIntermediate,
    LeftRingDistal,
    LeftLittleProximal,
    LeftLittleIntermediate,
    LeftLittleDistal,
    RightThumbMetacarpal,
    RightThumbProximal,
    RightThumbDistal,
    RightIndexProximal,
    RightIndexIntermediate,
    RightIndexDistal,
    RightMiddleProximal,
    RightMiddleIntermediate,
    RightMiddleDistal,
    RightRingProximal,
    RightRingIntermediate,
    RightRingDistal,
    RightLittleProximal,
    RightLittleIntermediate,
    RightLittleDistal,
);

use Joint::*;

/// VRM names in index order.
const NAMES: [&str; JOINT_COUNT] = [
    "hips",
    "spine",
    "chest",
    "upperChest",
    "neck",
    "head",
    "leftShoulder",
    "leftUpperArm",
    "leftLowerArm",
    "leftHand",
    "leftUpperLeg",
    "leftLowerLeg",
    "leftFoot",
    "leftToes",
    "rightShoulder",
    "rightUpperArm",
    "rightLowerArm",
    "rightHand",
    "rightUpperLeg",
    "rightLowerLeg",
    "rightFoot",
    "rightToes",
    "leftThumbMetacarpal",
    "leftThumbProximal",
    "leftThumbDistal",
    "leftIndexProximal",
    "leftIndexIntermediate",
    "leftIndexDistal",
    "leftMiddleProximal",
    "leftMiddleIntermediate",
    "leftMiddleDistal",
    "leftRingProximal",
    "leftRingIntermediate",
    "leftRingDistal",
    "leftLittleProximal",
    "leftLittleIntermediate",
    "leftLittleDistal",
    "rightThumbMetacarpal",
    "rightThumbProximal",
    "rightThumbDistal",
    "rightIndexProximal",
    "rightIndexIntermediate",
    "rightIndexDistal",
    "rightMiddleProximal",
    "rightMiddleIntermediate",
    "rightMiddleDistal",
    "rightRingProximal",
    "rightRingIntermediate",
    "rightRingDistal",
    "rightLittleProximal",
    "rightLittleIntermediate",
    "rightLittleDistal",
];

/// Parent of each joint in index order.
const PARENTS: [Option<Joint>; JOINT_COUNT] = [
    None,
    Some(Hips),
    Some(Spine),
    Some(Chest),
    Some(UpperChest),
    Some(Neck),
    Some(UpperChest),
    Some(LeftShoulder),
    Some(LeftUpperArm),
    Some(LeftLowerArm),
    Some(Hips),
    Some(LeftUpperLeg),
    Some(LeftLowerLeg),
    Some(LeftFoot),
    Some(UpperChest),
    Some(RightShoulder),
    Some(RightUpperArm),
    Some(RightLowerArm),
    Some(Hips),
    Some(RightUpperLeg),
    Some(RightLowerLeg),
    Some(RightFoot),
    Some(LeftHand),
    Some(LeftThumbMetacarpal),
    Some(LeftThumbProximal),
    Some(LeftHand),
    Some(LeftIndexProximal),
    Some(LeftIndexIntermediate),
    Some(LeftHand),
    Some(LeftMiddleProximal),
    Some(LeftMiddleIntermediate),
    Some(LeftHand),
    Some(LeftRingProximal),
    Some(LeftRingIntermediate),
    Some(LeftHand),
    Some(LeftLittleProximal),
    Some(LeftLittleIntermediate),
    Some(RightHand),
    Some(RightThumbMetacarpal),
    Some(RightThumbProximal),
    Some(RightHand),
    Some(RightIndexProximal),
    Some(RightIndexIntermediate),
    Some(RightHand),
    Some(RightMiddleProximal),
    Some(RightMiddleIntermediate),
    Some(RightHand),
    Some(RightRingProximal),
    Some(RightRingIntermediate),
    Some(RightHand),
    Some(RightLittleProximal),
    Some(RightLittleIntermediate),
];

impl Joint {
    /// Index, 0 (hips) to 51.
    pub fn index(self) -> usize {
        self as usize
    }

    /// The joint with this index.
    pub fn from_index(index: usize) -> Option<Self> {
        JOINTS.get(index).copied()
    }

    /// VRM 1.0 bone name, such as `leftUpperArm`.
    pub fn name(self) -> &'static str {
        NAMES[self.index()]
    }

    /// The joint with this VRM name.
    pub fn from_name(name: &str) -> Option<Self> {
        NAMES.iter().position(|n| *n == name).and_then(Self::from_index)
    }

    /// The joint it hangs on; `None` for the hips.
    pub fn parent(self) -> Option<Self> {
        PARENTS[self.index()]
    }

    /// True for the 30 joints of fingers and thumbs.
    pub fn is_finger(self) -> bool {
        self.index() >= LeftThumbMetacarpal.index()
    }

    /// The same joint on the other side; middle joints are their own mirror.
    pub fn mirrored(self) -> Self {
        let name = self.name();
        let other = match (name.strip_prefix("left"), name.strip_prefix("right")) {
            (Some(rest), _) => Self::from_name(&format!("right{rest}")),
            (_, Some(rest)) => Self::from_name(&format!("left{rest}")),
            _ => None,
        };
        other.unwrap_or(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_parents_and_indices_agree() {
        for (i, joint) in JOINTS.iter().enumerate() {
            assert_eq!(joint.index(), i);
            assert_eq!(Joint::from_name(joint.name()), Some(*joint));
            assert_eq!(joint.mirrored().mirrored(), *joint);
            assert!(joint.parent().is_none_or(|p| p.index() < i));
        }
        assert_eq!(JOINTS.iter().filter(|j| j.is_finger()).count(), 30);
        assert_eq!(LeftFoot.mirrored(), RightFoot);
    }
}
