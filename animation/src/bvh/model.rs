//! A motion as a BVH file holds it, and where its frames put the joints.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

/// One channel of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channel {
    /// Place along an axis (0 = x, 1 = y, 2 = z), file units.
    Position(usize),
    /// Turn about an axis (0 = x, 1 = y, 2 = z), degrees.
    Rotation(usize),
}

/// One joint of the hierarchy.
#[derive(Debug, Clone, PartialEq)]
pub struct BvhJoint {
    /// Name as in the file.
    pub name: String,
    /// Index of the parent, always lower than the joint's own; `None` for the root.
    pub parent: Option<usize>,
    /// Place in the parent's frame at zero rotations, file units.
    pub offset: Vector3<f64>,
    /// Channels in file order.
    pub channels: Vec<Channel>,
    /// Offset of its End Site, where it has one.
    pub end_site: Option<Vector3<f64>>,
}

/// Frame times that are believed, seconds: from 100,000 frames a second to one frame an hour.
pub const FRAME_TIMES: std::ops::RangeInclusive<f64> = 1e-5..=3600.0;

/// A motion as a BVH file holds it.
#[derive(Debug, Clone, PartialEq)]
pub struct Bvh {
    /// Joints, parents before children.
    pub joints: Vec<BvhJoint>,
    /// Seconds between two frames, within [`FRAME_TIMES`].
    pub frame_time: f64,
    /// Channel values of every frame, all joints' channels one after the other.
    pub frames: Vec<Vec<f64>>,
    /// True where position channels of joints other than the root add to their offset; false where they replace it.
    pub positions_add: bool,
    /// Problems of the file that could be put right, a sentence each.
    pub warnings: Vec<String>,
}

impl Bvh {
    /// Number of values in a frame.
    pub fn channel_count(&self) -> usize {
        self.joints.iter().map(|j| j.channels.len()).sum()
    }

    /// `file_from_joint` of every joint in frame `frame`.
    ///
    /// # Panics
    /// Where `frame` is not below `frames.len()`.
    pub fn joint_frames(&self, frame: usize) -> Vec<Isometry3<f64>> {
        self.place_joints(&self.frames[frame])
    }

    /// `file_from_joint` of every joint at zero rotations, the root at its offset.
    pub fn rest_frames(&self) -> Vec<Isometry3<f64>> {
        let mut world: Vec<Isometry3<f64>> = Vec::with_capacity(self.joints.len());
        for joint in &self.joints {
            let local = Isometry3::from(Translation3::from(joint.offset));
            world.push(joint.parent.map_or(local, |p| world[p] * local));
        }
        world
    }

    fn place_joints(&self, values: &[f64]) -> Vec<Isometry3<f64>> {
        let mut world: Vec<Isometry3<f64>> = Vec::with_capacity(self.joints.len());
        let mut first = 0;
        for joint in &self.joints {
            let next = first + joint.channels.len();
            let adds = self.positions_add && joint.parent.is_some();
            let local = joint.local(&values[first..next], adds);
            first = next;
            world.push(joint.parent.map_or(local, |p| world[p] * local));
        }
        world
    }
}

impl BvhJoint {
    /// `parent_from_joint` for this joint's channel `values`.
    fn local(&self, values: &[f64], positions_add: bool) -> Isometry3<f64> {
        let mut rotation = UnitQuaternion::identity();
        let mut position = self.offset;
        for (channel, &value) in self.channels.iter().zip(values) {
            match *channel {
                Channel::Position(axis) if positions_add => position[axis] += value,
                Channel::Position(axis) => position[axis] = value,
                Channel::Rotation(axis) => {
                    let axis = Vector3::ith_axis(axis);
                    rotation *= UnitQuaternion::from_axis_angle(&axis, value.to_radians());
                }
            }
        }
        Isometry3::from_parts(Translation3::from(position), rotation)
    }

    /// Position of its End Site when the joint stands at `file_from_joint`.
    pub fn end_position(&self, file_from_joint: &Isometry3<f64>) -> Option<Point3<f64>> {
        self.end_site.map(|offset| file_from_joint * Point3::from(offset))
    }
}
