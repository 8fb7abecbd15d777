//! A motion as a `SkelAnimation`: every joint's place and turn in its parent, a time code a pose.

use nalgebra::{Quaternion, UnitQuaternion};
use toile_character::{Motion, Pose, Skeleton, joint::JOINTS};

use super::{
    skeleton::paths,
    text::{array, string, tuple},
};
use crate::Avatar;

/// The prim `name` of `motion`.
pub(super) fn animation(avatar: &Avatar, motion: &Motion, name: &str) -> String {
    let mut before = avatar.pose0.rotations.clone();
    let (mut places, mut turns) = (String::new(), String::new());
    for (frame, pose) in motion.poses.iter().enumerate() {
        places.push_str(&format!("            {frame}: {},\n", translations(&avatar.skeleton, pose)));
        before = before.iter().zip(&pose.rotations).map(|(b, now)| nearer(b, now)).collect();
        turns.push_str(&format!("            {frame}: {},\n", array(before.iter().map(quaternion))));
    }
    format!(
        "    def SkelAnimation \"{name}\" (\n        customData = {{\n            string name = {}\n        }}\n    )\n    {{\n        \
         uniform token[] joints = {}\n        half3[] scales = {}\n        float3[] translations.timeSamples = {{\n{places}        }}\n        \
         quatf[] rotations.timeSamples = {{\n{turns}        }}\n    }}\n\n",
        string(&motion.name),
        paths(avatar.joint_names),
        array(JOINTS.iter().map(|_| "(1, 1, 1)")),
    )
}

/// The place of every joint in its parent's frame, metres; only the hips' changes.
fn translations(skeleton: &Skeleton, pose: &Pose) -> String {
    array(JOINTS.iter().map(|&joint| {
        let moved = if joint.parent().is_none() { pose.translation } else { nalgebra::Vector3::zeros() };
        tuple((skeleton.offset(joint) + moved).cast::<f32>().iter())
    }))
}

/// Of the two quaternions that are the rotation `now` the one nearer to `before`, so that what lies between two frames is on
/// the short way.
fn nearer(before: &UnitQuaternion<f64>, now: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    if now.coords.dot(&before.coords) < 0.0 { UnitQuaternion::new_unchecked(-now.into_inner()) } else { *now }
}

/// The real part first.
fn quaternion(rotation: &UnitQuaternion<f64>) -> String {
    let Quaternion { coords } = rotation.into_inner();
    tuple([coords.w, coords.x, coords.y, coords.z].map(|c| c as f32))
}
