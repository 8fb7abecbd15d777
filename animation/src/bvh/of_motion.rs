//! A motion of this project's own skeleton as a BVH file holds it.

use nalgebra::{UnitQuaternion, Vector3};
use toile_character::{Joint, JointNaming, Motion, Pose, Skeleton, joint::JOINTS};

use super::model::{Bvh, BvhJoint, Channel};

impl Bvh {
    /// `motion` on the `skeleton` that it was made for, joints named by `naming`: 52 joints, offsets and the hips' places in
    /// metres, +Y up, +Z the front. At zero rotations it stands in the A-pose rest. Only the hips have position channels; rotations
    /// are turned about z, then y, then x. The End Sites of head, toes and finger tips are guesses: as far away as the joint
    /// is from its parent; no motion depends on them.
    pub fn of_motion(skeleton: &Skeleton, motion: &Motion, naming: JointNaming) -> Self {
        // A file's values follow its text, which is written depth first.
        let order = depth_first(Joint::Hips);
        let place = |joint: Joint| order.iter().position(|j| *j == joint);
        let joint = |&joint: &Joint| BvhJoint {
            name: naming.name(joint),
            parent: joint.parent().and_then(place),
            offset: skeleton.offset(joint),
            channels: channels(joint),
            end_site: children(joint).next().is_none().then(|| skeleton.offset(joint)),
        };
        Self {
            joints: order.iter().map(joint).collect(),
            frame_time: motion.frame_time,
            frames: motion.poses.iter().map(|pose| values(&order, skeleton, pose)).collect(),
            positions_add: false,
            warnings: Vec::new(),
        }
    }
}

fn children(joint: Joint) -> impl Iterator<Item = Joint> {
    JOINTS.into_iter().filter(move |child| child.parent() == Some(joint))
}

fn depth_first(joint: Joint) -> Vec<Joint> {
    std::iter::once(joint).chain(children(joint).flat_map(depth_first)).collect()
}

fn channels(joint: Joint) -> Vec<Channel> {
    let places = if joint.parent().is_none() { 0..3 } else { 0..0 };
    places.map(Channel::Position).chain([2, 1, 0].map(Channel::Rotation)).collect()
}

/// The channel values of one frame.
fn values(order: &[Joint], skeleton: &Skeleton, pose: &Pose) -> Vec<f64> {
    let hips = skeleton.position(Joint::Hips).coords + pose.translation;
    let turns = order.iter().flat_map(|joint| degrees(&pose.rotation(*joint)));
    <[f64; 3]>::from(hips).into_iter().chain(turns).collect()
}

/// The angles about z, y and x, degrees, whose turns one after the other are `rotation`.
fn degrees(rotation: &UnitQuaternion<f64>) -> [f64; 3] {
    let (x, y, z) = rotation.euler_angles();
    Vector3::new(z, y, x).map(f64::to_degrees).into()
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;
    use toile_character::JOINT_COUNT;

    use super::*;
    use crate::bvh;

    #[test]
    fn a_motion_read_back_puts_every_joint_where_it_was() {
        let mut rest = [Point3::origin(); JOINT_COUNT];
        for (i, p) in rest.iter_mut().enumerate() {
            let t = i as f64;
            *p = Point3::new((t * 0.9).sin(), 1.0 + (t * 0.4).cos(), (t * 1.7).sin());
        }
        let skeleton = Skeleton { rest };
        let pose = |t: f64| {
            let turn = |j: usize| UnitQuaternion::from_euler_angles((t + j as f64).sin(), (t * j as f64).cos(), t);
            Pose { translation: Vector3::new(t, 0.1, -t), rotations: (0..JOINT_COUNT).map(turn).collect() }
        };
        let motion = Motion { name: "turns".into(), frame_time: 0.04, poses: vec![pose(0.2), pose(1.3)] };
        for naming in JointNaming::ALL {
            let text = bvh::write(&Bvh::of_motion(&skeleton, &motion, naming));
            let read = bvh::parse(&text, "turns").unwrap();
            assert_eq!((read.joints.len(), read.frames.len(), read.frame_time), (JOINT_COUNT, 2, 0.04));
            assert_eq!(read.joints.iter().filter(|j| j.end_site.is_some()).count(), 13);
            for (frame, pose) in motion.poses.iter().enumerate() {
                let wanted = pose.joint_frames(&skeleton);
                for (joint, at) in read.joints.iter().zip(read.joint_frames(frame)) {
                    let wanted = wanted[naming.joint(&joint.name).unwrap().index()];
                    // six decimals of metres and degrees, along a chain of joints
                    assert!((at.translation.vector - wanted.translation.vector).norm() < 1e-5, "{}", joint.name);
                    assert!(at.rotation.angle_to(&wanted.rotation) < 1e-6, "{}", joint.name);
                }
            }
        }
    }
}
