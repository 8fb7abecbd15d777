//! Stage `export`: the dressed avatar as files.
//!
//! Reads the body, every garment with its weights, and the motion. Writes `avatar.glb` and `avatar.vrm`, on request
//! without what clothes hide.

use std::path::Path;

use serde::Serialize;
use serde_json::{Value, json};
use toile_avatar::{Avatar, AvatarError, AvatarLayer, VrmMeta, write_glb, write_vrm};
use toile_character::JointNaming;
use toile_garments::{CullSettings, GarmentError, Worn, hidden_triangles};

use crate::{
    PipelineError, Run,
    body_file::Body,
    garment::{garment_type, thickness},
    motion,
    options::Options,
    skin_attributes::take_weights,
    stage::{Product, Record, Stage, plain},
};

/// Raised whenever the same inputs and settings give other files.
const VERSION: u32 = 3;
/// Expected seconds.
pub const COST: f64 = 0.5;

/// Writes the avatar's files with the motion and joint names that `options` choose, unless they are up to date; where
/// they say so without the triangles that clothes hide, which are counted.
///
/// # Errors
/// [`PipelineError`] where the motion cannot be used or files cannot be read or written.
pub fn run(run: &Run, body: &Body, options: &Options) -> Result<Record, PipelineError> {
    let Options { motion: bvh, cull, joint_names, .. } = options;
    let (bvh, cull) = (bvh.as_deref(), cull.as_ref());
    let folders = &run.folders;
    let mut inputs = vec![folders.body_mesh(), folders.body_json(), folders.pose(run.first_layer())];
    inputs.extend(run.garments().map(|l| folders.garment(l)));
    inputs.extend(bvh.map(Path::to_path_buf));
    let garments: Vec<Garment> = run.garment_numbers().map(|n| Garment::new(run, n)).collect::<Result<_, _>>()?;
    let mut settings = json!({
        "name": run.title(), "garments": plain(&garments)?, "joint_names": joint_names,
        "retarget": motion::settings(), "vrm": VrmMeta::default(),
    });
    if let Some(cull) = cull {
        settings["cull"] = plain(cull)?;
    }
    let stage = Stage {
        name: "export",
        version: VERSION,
        cost: COST,
        root: &folders.root,
        folder: folders.avatar(),
        inputs,
        settings,
        outputs: vec![folders.glb(), folders.vrm()],
        outputs_vary: false,
    };
    stage.run(&run.label("avatar", "export"), run.observer, |progress| {
        let moved = motion::load(bvh, &body.skinned.skeleton)?;
        let mut avatar = dressed(run, body, garments)?;
        let mut result = json!({ "motion": moved.report });
        if let Some(cull) = cull {
            result["left_out"] =
                leave_out_hidden(&mut avatar, cull).map_err(|e| PipelineError::stage(&folders.glb(), e))?;
        }
        progress(0.3);
        avatar.motions.push(moved.motion);
        avatar.joint_names = *joint_names;
        let wrong = |e: AvatarError| PipelineError::stage(&folders.glb(), e);
        let glb = write_glb(&avatar).map_err(wrong)?;
        progress(0.6);
        let vrm = write_vrm(&avatar, &VrmMeta::default()).map_err(wrong)?;
        Ok(Product { files: vec![(folders.glb(), glb), (folders.vrm(), vrm)], result, ..Product::default() })
    })
}

/// What is told of a garment in the files.
#[derive(Debug, Serialize)]
struct Garment {
    number: usize,
    garment_type: Option<String>,
    /// Metres.
    thickness: f32,
}

impl Garment {
    fn new(run: &Run, number: usize) -> Result<Self, PipelineError> {
        let garment_type = garment_type(run, number).map(|t| t.to_string());
        Ok(Self { number, garment_type, thickness: thickness(run, number)? })
    }
}

/// The avatar at rest in scan 0's pose: the body and every garment.
fn dressed(run: &Run, body: &Body, garments: Vec<Garment>) -> Result<Avatar, PipelineError> {
    let folders = &run.folders;
    let mesh = run.read_mesh(&folders.body_mesh())?;
    let weights = body.skinned.weights.clone();
    let mut layers = vec![AvatarLayer { name: "body".into(), mesh, weights, order: 0, garment: None, thickness: None }];
    for Garment { number, garment_type, thickness } in garments {
        let layer = &run.layers[number];
        let path = folders.garment(layer);
        let mut mesh = run.read_mesh(&path)?;
        let weights = take_weights(&mut mesh)
            .ok_or_else(|| PipelineError::format(&path, "has no skin weights; delete it and run again"))?;
        let (order, garment, thickness) = (number as u32, garment_type, Some(thickness));
        layers.push(AvatarLayer { name: layer.clone(), mesh, weights, order, garment, thickness });
    }
    let (skeleton, pose0) = (body.skinned.skeleton.clone(), body.pose0.clone());
    let (name, joint_names) = (run.title().to_string(), JointNaming::Vrm);
    Ok(Avatar { name, skeleton, joint_names, pose0, layers, motions: Vec::new() })
}

/// Takes triangles that clothes hide off every layer, and vertices that none uses any more; a layer of which nothing is
/// left goes as a whole. Returns how many triangles of how many were left out, by layer.
fn leave_out_hidden(avatar: &mut Avatar, settings: &CullSettings) -> Result<Value, GarmentError> {
    let worn: Vec<Worn> = avatar.layers.iter().map(|l| Worn { mesh: &l.mesh, weights: &l.weights }).collect();
    let hidden = hidden_triangles(&worn, settings)?;
    let mut told = json!({});
    for (layer, hidden) in avatar.layers.iter_mut().zip(&hidden) {
        let (mesh, old_of_new) = layer.mesh.filter_triangles(|t| !hidden[t]);
        let (all, left) = (hidden.len(), mesh.triangles.len());
        told[&layer.name] = json!({ "triangles": all - left, "of": all });
        (layer.mesh, layer.weights) = (mesh, layer.weights.gather(&old_of_new));
    }
    avatar.layers.retain(|l| !l.mesh.is_empty());
    Ok(told)
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;
    use toile_character::{JOINT_COUNT, Pose, Skeleton, SkinWeights};
    use toile_geometry::Mesh;

    use super::*;

    /// A square sheet over the floor at height `y`, facing up, a vertex every 20 mm.
    fn sheet(name: &str, order: u32, y: f32, cells: u32) -> AvatarLayer {
        let side = cells + 1;
        let at = |i: u32| (i as f32 - cells as f32 / 2.0) * 0.02;
        let positions = (0..side * side).map(|v| Point3::new(at(v % side), y, at(v / side))).collect();
        let corner = |c: u32| c / cells * side + c % cells;
        let cell = |c: u32| {
            let [a, b, c, d] = [corner(c), corner(c) + 1, corner(c) + side, corner(c) + side + 1];
            [[a, c, d], [a, d, b]]
        };
        let mesh = Mesh::new(positions, (0..cells * cells).flat_map(cell).collect());
        let mut weights = SkinWeights::default();
        (0..side * side).for_each(|v| weights.push(&[(0, 1.0 + v as f32), (1, 1.0)]));
        AvatarLayer { name: name.into(), mesh, weights, order, garment: None, thickness: None }
    }

    #[test]
    fn hidden_triangles_go_with_their_vertices_and_weights() {
        let (vest, coat) = (sheet("01-vest", 1, 0.002, 4), sheet("02-coat", 2, 0.004, 20));
        let body = sheet("body", 0, 0.0, 30);
        let skeleton = Skeleton { rest: [Point3::origin(); JOINT_COUNT] };
        let layers = vec![body.clone(), vest, coat.clone()];
        let (name, joint_names, pose0) = ("anna".into(), JointNaming::Vrm, Pose::identity());
        let mut avatar = Avatar { name, skeleton, joint_names, pose0, layers, motions: Vec::new() };
        let told = leave_out_hidden(&mut avatar, &CullSettings { margin: 0.03, reach: 0.1 }).unwrap();
        avatar.validate().unwrap();
        assert_eq!(avatar.layers.iter().map(|l| l.name.as_str()).collect::<Vec<_>>(), ["body", "02-coat"]);
        assert_eq!(told["01-vest"], json!({ "triangles": 32, "of": 32 }));
        assert_eq!(told["02-coat"], json!({ "triangles": 0, "of": 800 }));
        let left = &avatar.layers[0];
        assert_eq!(told["body"], json!({ "triangles": 1800 - left.mesh.triangles.len(), "of": 1800 }));
        assert!((1000..1600).contains(&left.mesh.triangles.len()), "{told}");
        assert!(left.mesh.positions.len() < body.mesh.positions.len());
        for (v, p) in left.mesh.positions.iter().enumerate() {
            let old = body.mesh.positions.iter().position(|q| q == p).unwrap();
            assert_eq!(left.weights.weights[v], body.weights.weights[old]);
        }
    }
}
