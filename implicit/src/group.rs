//! The fifteen groups that decide what blends with what (paper 002 §3.1).

use toile_character::Joint;

macro_rules! groups {
    ($($variant:ident $name:literal),+ $(,)?) => {
        /// A group of primitives and contours, by the paper's names.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[allow(missing_docs)] // the names are the documentation
        pub enum Group { $($variant),+ }

        impl Group {
            /// All groups in the paper's order.
            pub const ALL: [Self; 15] = [$(Self::$variant),+];

            /// The paper's name.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $name),+ }
            }
        }
    };
}

groups!(
    UpperTorso "upper_torso",
    LowerTorso "lower_torso",
    Hip "hip",
    LeftShoulder "left_shoulder",
    RightShoulder "right_shoulder",
    LeftUpperArm "left_upper_arm",
    LeftLowerArm "left_lower_arm",
    RightUpperArm "right_upper_arm",
    RightLowerArm "right_lower_arm",
    LeftUpperLeg "left_upper_leg",
    LeftLowerLeg "left_lower_leg",
    RightUpperLeg "right_upper_leg",
    RightLowerLeg "right_lower_leg",
    LeftAnkle "left_ankle",
    RightAnkle "right_ankle",
);

/// The name of the group whose primitives blend with all others.
pub const ROOT: &str = "root";

/// A set of groups.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Groups(u16);

impl Groups {
    /// All groups: what the root group blends with.
    pub const ROOT: Self = Self((1 << Group::ALL.len()) - 1);

    /// Whether `group` is in the set.
    pub fn contains(self, group: Group) -> bool {
        self.0 & (1 << group as u16) != 0
    }

    /// The set with `group` in it.
    #[must_use]
    pub fn with(self, group: Group) -> Self {
        Self(self.0 | (1 << group as u16))
    }

    /// The groups in it, in order.
    pub fn iter(self) -> impl Iterator<Item = Group> {
        Group::ALL.into_iter().filter(move |g| self.contains(*g))
    }

    /// Whether there is none.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Their names as a file has them.
    pub fn names(self) -> Vec<&'static str> {
        if self == Self::ROOT { vec![ROOT] } else { self.iter().map(Group::name).collect() }
    }
}

impl FromIterator<Group> for Groups {
    fn from_iter<I: IntoIterator<Item = Group>>(groups: I) -> Self {
        groups.into_iter().fold(Self::default(), Self::with)
    }
}

impl Group {
    /// The group with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|g| g.name() == name)
    }

    /// The group of a primitive by its attachment to the skeleton.
    pub fn of_joint(joint: Joint) -> Self {
        use Joint::*;
        let left = joint.name().starts_with("left");
        let side = |l: Self, r: Self| if left { l } else { r };
        match joint {
            Hips => Self::Hip,
            Spine => Self::LowerTorso,
            Chest | UpperChest | Neck | Head => Self::UpperTorso,
            LeftShoulder | RightShoulder => side(Self::LeftShoulder, Self::RightShoulder),
            LeftUpperArm | RightUpperArm => side(Self::LeftUpperArm, Self::RightUpperArm),
            LeftUpperLeg | RightUpperLeg => side(Self::LeftUpperLeg, Self::RightUpperLeg),
            LeftLowerLeg | RightLowerLeg => side(Self::LeftLowerLeg, Self::RightLowerLeg),
            LeftFoot | RightFoot | LeftToes | RightToes => side(Self::LeftAnkle, Self::RightAnkle),
            _ => side(Self::LeftLowerArm, Self::RightLowerArm),
        }
    }

    /// Whether primitives of the group `home` may also belong to this one: the parts of the body meet at a joint.
    pub fn meets(self, home: Self) -> bool {
        use Group::*;
        if self == home {
            return true;
        }
        let pair = |a: Self, b: Self| (self == a && home == b) || (self == b && home == a);
        let one_side = |shoulder, upper_arm, lower_arm, upper_leg, lower_leg, ankle| {
            pair(UpperTorso, shoulder)
                || pair(shoulder, upper_arm)
                || pair(upper_arm, lower_arm)
                || pair(Hip, upper_leg)
                || pair(upper_leg, lower_leg)
                || pair(lower_leg, ankle)
        };
        pair(UpperTorso, LowerTorso)
            || pair(LowerTorso, Hip)
            || one_side(LeftShoulder, LeftUpperArm, LeftLowerArm, LeftUpperLeg, LeftLowerLeg, LeftAnkle)
            || one_side(RightShoulder, RightUpperArm, RightLowerArm, RightUpperLeg, RightLowerLeg, RightAnkle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use toile_character::joint::JOINTS;

    #[test]
    fn names_are_read_back_and_sides_never_meet() {
        for g in Group::ALL {
            assert_eq!(Group::from_name(g.name()), Some(g));
            for other in Group::ALL {
                assert_eq!(g.meets(other), other.meets(g));
                let sides = (g.name().starts_with("left"), other.name().starts_with("right"));
                assert!(sides != (true, true) || !g.meets(other), "{g:?} {other:?}");
            }
        }
        assert!(Group::Hip.meets(Group::LeftUpperLeg) && !Group::LeftUpperLeg.meets(Group::LeftAnkle));
    }

    #[test]
    fn every_joint_has_its_mirrored_group() {
        for joint in JOINTS {
            let mirrored = |name: &str| name.replace("left", "#").replace("right", "left").replace('#', "right");
            let (here, there) = (Group::of_joint(joint), Group::of_joint(joint.mirrored()));
            assert_eq!(mirrored(here.name()), there.name(), "{joint:?}");
        }
        assert_eq!(Group::of_joint(Joint::LeftIndexDistal), Group::LeftLowerArm);
    }

    #[test]
    fn a_set_holds_what_was_put_in() {
        let set: Groups = [Group::Hip, Group::LeftAnkle].into_iter().collect();
        assert!(set.contains(Group::Hip) && !set.contains(Group::RightAnkle) && !set.is_empty());
        assert_eq!(set.names(), ["hip", "left_ankle"]);
        assert_eq!(Groups::ROOT.names(), ["root"]);
        assert_eq!(Groups::ROOT.iter().count(), 15);
    }
}
