//! Spring bones in a VRM file (VRM Consortium, VRMC_springBone-1.0).

use nalgebra::Point3;
use serde_json::{Value, json};
use toile_character::{JOINT_COUNT, SpringBones, SpringChain, SpringCollider};

use crate::{Avatar, AvatarError};

/// The extension's name.
pub(crate) const EXTENSION: &str = "VRMC_springBone";

/// Puts the avatar's layers, which rest in their T-pose, on the joints of `springs`.
pub(crate) fn hang(avatar: &mut Avatar, springs: &SpringBones) -> Result<(), AvatarError> {
    check(avatar, springs).map_err(AvatarError::Springs)?;
    for (layer, weights) in avatar.layers.iter_mut().zip(&springs.weights) {
        if let Some(weights) = weights {
            layer.weights = weights.clone();
        }
    }
    avatar.validate_with(JOINT_COUNT + springs.joint_count())
}

fn check(avatar: &Avatar, springs: &SpringBones) -> Result<(), String> {
    let (layers, weights) = (avatar.layers.len(), springs.weights.len());
    if layers != weights {
        return Err(format!("weights for {weights} layers, but the avatar has {layers}"));
    }
    if JOINT_COUNT + springs.joint_count() > 256 {
        return Err(format!("{} joints; a file holds {}", springs.joint_count(), 256 - JOINT_COUNT));
    }
    let finite = |p: &Point3<f64>| p.coords.iter().all(|c| c.is_finite());
    let length = |x: f64| x.is_finite() && x >= 0.0;
    for chain in &springs.chains {
        let sound = chain.joints.iter().all(|j| finite(&j.place) && length(j.stiffness) && length(j.hit_radius));
        let bones = chain.joints.windows(2).all(|pair| (pair[1].place - pair[0].place).norm() > 1e-4);
        if chain.joints.len() < 2 || !sound || !bones {
            let name = &chain.name;
            return Err(format!(
                "the chain {name:?} needs two joints or more, apart from each other, with numbers of 0 or more"
            ));
        }
    }
    if !springs.colliders.iter().all(|c| c.ends.iter().all(finite) && length(c.radius)) {
        return Err("a collider has a place or radius that is no length".into());
    }
    if !(0.0..=1.0).contains(&springs.drag) {
        return Err(format!("the drag is {}; it lies from 0 to 1", springs.drag));
    }
    Ok(())
}

/// The extension's object. `avatar` rests in its T-pose, where all nodes have the scene's axes. Chains swing in the space of the node
/// `root`: who walks through a scene because a program moves that node is in no wind.
pub(crate) fn extension(springs: &SpringBones, avatar: &Avatar, root: usize) -> Value {
    let joints = avatar.pose0.joint_positions(&avatar.skeleton);
    let mut node = JOINT_COUNT;
    let mut chains = Vec::with_capacity(springs.chains.len());
    for chain in &springs.chains {
        chains.push(spring(chain, node, springs.drag, root));
        node += chain.joints.len();
    }
    json!({
        "specVersion": "1.0",
        "colliders": springs.colliders.iter().map(|c| collider(c, &joints)).collect::<Vec<_>>(),
        "colliderGroups": [{ "name": "legs", "colliders": (0..springs.colliders.len()).collect::<Vec<_>>() }],
        "springs": chains,
    })
}

/// A chain whose first joint is the node `first`.
fn spring(chain: &SpringChain, first: usize, drag: f64, root: usize) -> Value {
    let joint = |(k, joint): (usize, &toile_character::SpringJoint)| {
        json!({
            "node": first + k,
            "hitRadius": joint.hit_radius,
            "stiffness": joint.stiffness,
            "gravityPower": 0.0,
            "gravityDir": [0.0, -1.0, 0.0],
            "dragForce": drag,
        })
    };
    let joints: Vec<Value> = chain.joints.iter().enumerate().map(joint).collect();
    json!({ "name": chain.name, "joints": joints, "colliderGroups": [0], "center": root })
}

fn collider(capsule: &SpringCollider, joints: &[Point3<f64>]) -> Value {
    let node = capsule.joint.index();
    let [offset, tail] = capsule.ends.map(|p| p - joints[node]);
    json!({
        "node": node,
        "shape": { "capsule": { "offset": offset.as_slice(), "radius": capsule.radius, "tail": tail.as_slice() } },
    })
}
