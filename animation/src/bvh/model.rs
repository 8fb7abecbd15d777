//! A motion as a BVH file holds it, and where its frames put the joints.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use crate::AnimationError;

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

/// A joint of a motion that was not read from a BVH file.
#[derive(Debug, Clone, PartialEq)]
pub struct RestJoint {
    /// Its name.
    pub name: String,
    /// Index of the parent, lower than the joint's own; `None` for a root.
    pub parent: Option<usize>,
    /// `file_from_joint` at rest, file units.
    pub rest: Isometry3<f64>,
}

impl Bvh {
    /// A motion of other files as a BVH file would hold it: `frames` has `file_from_joint` of every joint. At zero rotations
    /// the joints stand at rest, whichever way their own axes point; several roots hang on one more joint.
    ///
    /// # Errors
    /// [`AnimationError::Motion`] where a parent does not come before its child or a frame has not all joints.
    pub fn of_joints(
        joints: &[RestJoint],
        frame_time: f64,
        frames: &[Vec<Isometry3<f64>>],
    ) -> Result<Self, AnimationError> {
        let is_ordered = joints.iter().enumerate().all(|(j, joint)| joint.parent.is_none_or(|p| p < j));
        if !is_ordered || frames.iter().any(|frame| frame.len() != joints.len()) {
            return Err(AnimationError::Motion("its joints are out of order or missing in a frame".into()));
        }
        let root = BvhJoint {
            name: "scene".into(),
            parent: None,
            offset: Vector3::zeros(),
            channels: Vec::new(),
            end_site: None,
        };
        let parent_place =
            |joint: &RestJoint| joint.parent.map_or_else(Vector3::zeros, |p| joints[p].rest.translation.vector);
        let bvh_joint = |joint: &RestJoint| BvhJoint {
            name: joint.name.clone(),
            parent: Some(joint.parent.map_or(0, |p| p + 1)),
            offset: joint.rest.translation.vector - parent_place(joint),
            channels: [0, 1, 2].map(Channel::Position).into_iter().chain([2, 1, 0].map(Channel::Rotation)).collect(),
            end_site: None,
        };
        let values = |frame: &Vec<Isometry3<f64>>| {
            // turned from rest, so that all joints' axes are the file's at rest
            let turned: Vec<Isometry3<f64>> = frame
                .iter()
                .zip(joints)
                .map(|(now, joint)| {
                    Isometry3::from_parts(now.translation, now.rotation * joint.rest.rotation.inverse())
                })
                .collect();
            let local = |(j, joint): (usize, &RestJoint)| {
                let local = joint.parent.map_or(turned[j], |p| turned[p].inverse() * turned[j]);
                let (x, y, z) = local.rotation.euler_angles();
                let at = local.translation.vector;
                [at.x, at.y, at.z, z.to_degrees(), y.to_degrees(), x.to_degrees()]
            };
            joints.iter().enumerate().flat_map(local).collect()
        };
        Ok(Self {
            joints: std::iter::once(root).chain(joints.iter().map(bvh_joint)).collect(),
            frame_time,
            frames: frames.iter().map(values).collect(),
            positions_add: false,
            warnings: Vec::new(),
        })
    }

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joints_of_other_files_stand_where_their_frames_put_them() {
        let turn = |x: f64, y: f64, z: f64| UnitQuaternion::from_euler_angles(x, y, z);
        let at = |x: f64, y: f64, q: UnitQuaternion<f64>| Isometry3::from_parts(Translation3::new(x, y, 0.1), q);
        let joint = |name: &str, parent, rest| RestJoint { name: name.into(), parent, rest };
        let joints = [
            joint("hips", None, at(0.0, 1.0, turn(0.4, 0.0, 1.5))),
            joint("knee", Some(0), at(0.1, 0.5, turn(-1.0, 0.7, 0.0))),
            joint("other root", None, at(2.0, 0.0, turn(0.0, 0.0, 0.3))),
        ];
        let frame = vec![
            at(0.2, 1.1, turn(0.1, 1.2, -0.4)),
            at(0.3, 0.6, turn(0.9, -0.3, 2.0)),
            at(2.0, 0.1, turn(0.0, 0.1, 0.0)),
        ];
        let bvh = Bvh::of_joints(&joints, 0.02, std::slice::from_ref(&frame)).unwrap();
        for (k, world) in bvh.joint_frames(0).iter().skip(1).enumerate() {
            let wanted = frame[k].rotation * joints[k].rest.rotation.inverse();
            assert!((world.translation.vector - frame[k].translation.vector).norm() < 1e-9);
            assert!(world.rotation.angle_to(&wanted) < 1e-9, "{k}");
            assert!((bvh.rest_frames()[k + 1].translation.vector - joints[k].rest.translation.vector).norm() < 1e-9);
        }
        let late = [joint("knee", Some(1), frame[0]), joint("hips", None, frame[1])];
        assert!(Bvh::of_joints(&late, 0.02, &[]).is_err());
    }
}
