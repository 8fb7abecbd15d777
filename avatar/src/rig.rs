//! The skeleton as glTF nodes and a skin.

use nalgebra::{Isometry3, Point3, Translation3};
use serde_json::{Map, Value, json};
use toile_character::{JOINT_COUNT, Joint, JointLimit, JointNaming, Pose, Skeleton, joint::JOINTS, joint_limits};

use crate::buffer::{Buffer, Shape, Target};

/// Joint frames that the layers are bound to; node i is the joint with index i.
pub(crate) struct Rig {
    /// `scene_from_joint`, by [`Joint::index`].
    frames: Vec<Isometry3<f64>>,
    /// How far the nodes' rotations go.
    limits: Vec<JointLimit>,
    /// Names and places of joints beside the skeleton's, below the hips; their axes are the scene's.
    helpers: Vec<(String, Isometry3<f64>)>,
}

impl Rig {
    /// Joints as they stand and are turned in `pose`.
    pub fn posed(skeleton: &Skeleton, pose: &Pose) -> Self {
        Self { frames: pose.joint_frames(skeleton), limits: joint_limits(skeleton), helpers: Vec::new() }
    }

    /// Joints where `pose` puts them, all axes along the scene's, as VRM likes its rest.
    pub fn unturned(skeleton: &Skeleton, pose: &Pose) -> Self {
        let place = |p: &Point3<f64>| Isometry3::from(Translation3::from(p.coords));
        let limits = joint_limits(skeleton).iter().map(|l| l.from_rest(pose)).collect();
        Self { frames: pose.joint_positions(skeleton).iter().map(place).collect(), limits, helpers: Vec::new() }
    }

    /// The same with helper joints that rest at `centers`, nodes behind the skeleton's.
    pub fn with_helpers(self, names: &[String], centers: &[Point3<f64>]) -> Self {
        let placed = centers.iter().map(|c| Isometry3::from(Translation3::from(c.coords)));
        Self { helpers: names.iter().cloned().zip(placed).collect(), ..self }
    }

    /// `parent_from_joint` of `joint`.
    fn local(&self, joint: Joint) -> Isometry3<f64> {
        let frame = self.frames[joint.index()];
        joint.parent().map_or(frame, |p| self.frames[p.index()].inverse() * frame)
    }

    /// The 52 nodes in joint order, then those of helpers.
    pub fn nodes(&self, naming: JointNaming) -> Vec<Value> {
        let hips_from_scene = self.frames[Joint::Hips.index()].inverse();
        let helper = |(name, frame): &(String, Isometry3<f64>)| placed(name, &(hips_from_scene * frame));
        let skeleton = JOINTS.iter().map(|&joint| self.node(joint, naming));
        skeleton.chain(self.helpers.iter().map(helper)).map(Value::Object).collect()
    }

    fn node(&self, joint: Joint, naming: JointNaming) -> Map<String, Value> {
        let mut children: Vec<usize> = JOINTS.iter().filter(|c| c.parent() == Some(joint)).map(|c| c.index()).collect();
        if joint == Joint::Hips {
            children.extend((0..self.helpers.len()).map(|h| JOINT_COUNT + h));
        }
        let mut node = placed(&naming.name(joint), &self.local(joint));
        if !children.is_empty() {
            node.insert("children".into(), json!(children));
        }
        let limits: Vec<Value> = self.limits.iter().filter(|l| l.joint == joint).map(limit).collect();
        if !limits.is_empty() {
            node.insert("extras".into(), json!({ "limits": limits }));
        }
        node
    }

    /// The skin, its inverse bind matrices added to `buffer`.
    pub fn skin(&self, buffer: &mut Buffer) -> Value {
        let frames: Vec<&Isometry3<f64>> = self.frames.iter().chain(self.helpers.iter().map(|h| &h.1)).collect();
        let mut matrices: Vec<f32> = Vec::with_capacity(16 * frames.len());
        for frame in &frames {
            matrices.extend(frame.inverse().to_homogeneous().cast::<f32>().iter());
        }
        json!({
            "name": "skeleton",
            "skeleton": Joint::Hips.index(),
            "joints": (0..frames.len()).collect::<Vec<_>>(),
            "inverseBindMatrices": buffer.add(&matrices, Shape::Mat4, Target::Data),
        })
    }
}

/// A node where `parent_from_node` puts it.
fn placed(name: &str, parent_from_node: &Isometry3<f64>) -> Map<String, Value> {
    let mut node = Map::new();
    node.insert("name".into(), json!(name));
    node.insert("translation".into(), json!(parent_from_node.translation.vector.as_slice()));
    if parent_from_node.rotation.angle() > 0.0 {
        // In f64 a product of unit quaternions can exceed 1 in the last digit, which the format forbids.
        let rotation = parent_from_node.rotation.coords.map(|c| (c as f32).clamp(-1.0, 1.0));
        node.insert("rotation".into(), json!(rotation.as_slice()));
    }
    node
}

/// Bounds of the component about `axis` (in the parent node's frame) of the rotation vector of a node's `rotation`; glTF and VRM 1.0
/// have no field of their own for it.
fn limit(limit: &JointLimit) -> Value {
    let rounded = |x: f64| (x * 1e6).round() / 1e6;
    json!({
        "axis": limit.axis.map(rounded).as_slice(),
        "low_rad": rounded(limit.low),
        "high_rad": rounded(limit.high),
    })
}
