//! Where the joints of one person rest.

use nalgebra::Point3;

use crate::joint::{JOINT_COUNT, JOINTS, Joint};

/// Joint positions of one person in a rest pose, in the frame of the rest mesh (metres).
///
/// Rest orientations are all identity: a joint's local axes are the frame's own axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Skeleton {
    /// Position of each joint, by [`Joint::index`].
    pub rest: [Point3<f64>; JOINT_COUNT],
}

impl Skeleton {
    /// Rest position of `joint`.
    pub fn position(&self, joint: Joint) -> Point3<f64> {
        self.rest[joint.index()]
    }

    /// Offset of `joint` from its parent at rest (from the origin for the hips).
    pub fn offset(&self, joint: Joint) -> nalgebra::Vector3<f64> {
        match joint.parent() {
            Some(parent) => self.position(joint) - self.position(parent),
            None => self.position(joint).coords,
        }
    }

    /// Joints in index order with their rest positions.
    pub fn iter(&self) -> impl Iterator<Item = (Joint, Point3<f64>)> + '_ {
        JOINTS.iter().map(|&j| (j, self.position(j)))
    }
}
