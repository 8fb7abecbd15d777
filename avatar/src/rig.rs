//! The skeleton as glTF nodes and a skin.

use nalgebra::{Isometry3, Point3, Translation3};
use serde_json::{Map, Value, json};
use toile_character::{
    JOINT_COUNT, Joint, JointLimit, JointNaming, Pose, Skeleton, SpringBones, joint::JOINTS, joint_limits,
};

use crate::buffer::{Buffer, Shape, Target};

/// Joint frames that the layers are bound to; node i is the joint with index i.
pub(crate) struct Rig {
    /// `scene_from_joint`, by [`Joint::index`].
    frames: Vec<Isometry3<f64>>,
    /// How far the nodes' rotations go.
    limits: Vec<JointLimit>,
    /// Joints beside the skeleton's, nodes behind them.
    helpers: Vec<Helper>,
    /// Whether a node without a turn of its own stands above the hips, behind all others.
    has_root: bool,
}

/// A joint beside the skeleton's; its axes are the scene's.
struct Helper {
    name: String,
    /// `scene_from_helper`.
    frame: Isometry3<f64>,
    /// Node that it is a child of.
    parent: usize,
}

impl Rig {
    /// Joints as they stand and are turned in `pose`.
    pub fn posed(skeleton: &Skeleton, pose: &Pose) -> Self {
        Self {
            frames: pose.joint_frames(skeleton),
            limits: joint_limits(skeleton),
            helpers: Vec::new(),
            has_root: false,
        }
    }

    /// Joints where `pose` puts them, all axes along the scene's, as VRM likes its rest.
    pub fn unturned(skeleton: &Skeleton, pose: &Pose) -> Self {
        let place = |p: &Point3<f64>| Isometry3::from(Translation3::from(p.coords));
        let limits = joint_limits(skeleton).iter().map(|l| l.from_rest(pose)).collect();
        Self {
            frames: pose.joint_positions(skeleton).iter().map(place).collect(),
            limits,
            helpers: Vec::new(),
            has_root: false,
        }
    }

    /// The same with helper joints that rest at `centers` below the hips, nodes behind the skeleton's.
    pub fn with_helpers(self, names: &[String], centers: &[Point3<f64>]) -> Self {
        let place = |c: &Point3<f64>| Isometry3::from(Translation3::from(c.coords));
        let helper = |(name, c): (&String, &Point3<f64>)| Helper {
            name: name.clone(),
            frame: place(c),
            parent: Joint::Hips.index(),
        };
        Self { helpers: names.iter().zip(centers).map(helper).collect(), ..self }
    }

    /// The same with the joints of spring bones, chain by chain, nodes behind the skeleton's, and a root above the hips: chains
    /// swing in the space of that node.
    pub fn with_springs(self, springs: &SpringBones) -> Self {
        let mut helpers = Vec::with_capacity(springs.joint_count());
        for chain in &springs.chains {
            for (k, joint) in chain.joints.iter().enumerate() {
                let parent = if k == 0 { Joint::Hips.index() } else { JOINT_COUNT + helpers.len() - 1 };
                let frame = Isometry3::from(Translation3::from(joint.place.coords));
                helpers.push(Helper { name: format!("{} joint {}", chain.name, k + 1), frame, parent });
            }
        }
        Self { helpers, has_root: true, ..self }
    }

    /// Number of [`Rig::nodes`].
    pub fn node_count(&self) -> usize {
        JOINT_COUNT + self.helpers.len() + usize::from(self.has_root)
    }

    /// The topmost node of the skeleton.
    pub fn top(&self) -> usize {
        if self.has_root { JOINT_COUNT + self.helpers.len() } else { Joint::Hips.index() }
    }

    /// `parent_from_joint` of `joint`.
    fn local(&self, joint: Joint) -> Isometry3<f64> {
        let frame = self.frames[joint.index()];
        joint.parent().map_or(frame, |p| self.frames[p.index()].inverse() * frame)
    }

    /// The 52 nodes in joint order, then those of helpers, then the root where there is one.
    pub fn nodes(&self, naming: JointNaming) -> Vec<Value> {
        let skeleton = JOINTS.iter().map(|&joint| self.node(joint, naming));
        let helpers = (0..self.helpers.len()).map(|h| self.helper(h));
        let mut nodes: Vec<Value> = skeleton.chain(helpers).map(Value::Object).collect();
        if self.has_root {
            nodes.push(json!({ "name": "root", "children": [Joint::Hips.index()] }));
        }
        nodes
    }

    fn node(&self, joint: Joint, naming: JointNaming) -> Map<String, Value> {
        let mut children: Vec<usize> = JOINTS.iter().filter(|c| c.parent() == Some(joint)).map(|c| c.index()).collect();
        children.extend(self.helpers_of(joint.index()));
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

    fn helper(&self, h: usize) -> Map<String, Value> {
        let Helper { name, frame, parent } = &self.helpers[h];
        let parent_frame = self.frames.get(*parent).unwrap_or_else(|| &self.helpers[parent - JOINT_COUNT].frame);
        let mut node = placed(name, &(parent_frame.inverse() * frame));
        let children: Vec<usize> = self.helpers_of(JOINT_COUNT + h).collect();
        if !children.is_empty() {
            node.insert("children".into(), json!(children));
        }
        node
    }

    /// Nodes of the helpers that are children of the node `parent`.
    fn helpers_of(&self, parent: usize) -> impl Iterator<Item = usize> + '_ {
        (0..self.helpers.len()).filter(move |&h| self.helpers[h].parent == parent).map(|h| JOINT_COUNT + h)
    }

    /// The skin, its inverse bind matrices added to `buffer`.
    pub fn skin(&self, buffer: &mut Buffer) -> Value {
        let frames: Vec<&Isometry3<f64>> = self.frames.iter().chain(self.helpers.iter().map(|h| &h.frame)).collect();
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
