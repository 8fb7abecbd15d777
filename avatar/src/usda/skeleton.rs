//! The skeleton: joints by path, where the layers are bound to them, and how they rest.

use nalgebra::Isometry3;
use toile_character::{Joint, JointNaming, joint::JOINTS};

use super::{
    names::identifier,
    text::{array, matrix, string},
};
use crate::Avatar;

/// The prim `name`; the animation called `plays` moves it.
pub(super) fn skeleton(avatar: &Avatar, name: &str, plays: Option<&str>) -> String {
    let frames = avatar.pose0.joint_frames(&avatar.skeleton);
    let local = |joint: Joint| -> Isometry3<f64> {
        let frame = frames[joint.index()];
        joint.parent().map_or(frame, |parent| frames[parent.index()].inverse() * frame)
    };
    let source =
        plays.map_or_else(String::new, |motion| format!("        rel skel:animationSource = </avatar/{motion}>\n"));
    let schema = if plays.is_some() { " (\n        prepend apiSchemas = [\"SkelBindingAPI\"]\n    )" } else { "" };
    format!(
        "    def Skeleton \"{name}\"{schema}\n    {{\n        uniform token[] joints = {}\n        uniform token[] jointNames = {}\n        \
         uniform matrix4d[] bindTransforms = {}\n        uniform matrix4d[] restTransforms = {}\n{source}    }}\n\n",
        paths(avatar.joint_names),
        array(JOINTS.iter().map(|joint| string(&avatar.joint_names.name(*joint)))),
        array(frames.iter().map(matrix)),
        array(JOINTS.iter().map(|joint| matrix(&local(*joint)))),
    )
}

/// The joints in their order, parents first, each with its ancestors: `"hips/spine/chest"`.
pub(super) fn paths(naming: JointNaming) -> String {
    array(JOINTS.iter().map(|joint| string(&path(*joint, naming))))
}

fn path(joint: Joint, naming: JointNaming) -> String {
    let name = identifier(&naming.name(joint));
    joint.parent().map_or_else(|| name.clone(), |parent| format!("{}/{name}", path(parent, naming)))
}
