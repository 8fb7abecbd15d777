//! Stage `export`: the dressed avatar as files.
//!
//! Reads the body, every garment with its weights, and the motion. Writes `avatar.glb` and `avatar.vrm`.

use std::path::Path;

use serde_json::json;
use toile_avatar::{Avatar, AvatarError, AvatarLayer, VrmMeta, write_glb, write_vrm};
use toile_character::{Pose, Skeleton, SkinWeights};
use toile_geometry::Mesh;

use crate::{
    StudioError,
    pipeline::{Run, body_file::Body, motion, skin_attributes::take_weights},
    stage::{Product, Record, Stage},
};

/// Raised whenever the same inputs and settings give other files.
const VERSION: u32 = 2;
/// Expected seconds.
pub const COST: f64 = 0.5;

/// Writes the avatar's files, unless they are up to date. `bvh` is the motion; without it, the shipped walk.
///
/// # Errors
/// [`StudioError`] where the motion cannot be used or files cannot be read or written.
pub fn run(run: &Run, body: &Body, bvh: Option<&Path>) -> Result<Record, StudioError> {
    let folders = &run.folders;
    let mut inputs = vec![folders.body_mesh(), folders.body_json(), folders.pose(run.first_layer())];
    inputs.extend(run.garments().map(|l| folders.garment(l)));
    inputs.extend(bvh.map(Path::to_path_buf));
    let types: Vec<Option<String>> = (0..run.layers.len()).map(|n| garment_type(run, n)).collect();
    let stage = Stage {
        name: "export",
        version: VERSION,
        cost: COST,
        root: &folders.root,
        folder: folders.avatar(),
        inputs,
        settings: json!({ "name": run.title(), "types": types, "retarget": motion::settings(), "vrm": VrmMeta::default() }),
        outputs: vec![folders.glb(), folders.vrm()],
        outputs_vary: false,
    };
    stage.run(&run.label("avatar", "export"), run.progress, |progress| {
        let moved = motion::load(bvh, &body.skinned.skeleton)?;
        let mut avatar = dressed(run, body, &types)?;
        progress(0.3);
        avatar.motions.push(moved.motion);
        let wrong = |e: AvatarError| StudioError::stage(&folders.glb(), e);
        let glb = write_glb(&avatar).map_err(wrong)?;
        progress(0.6);
        let vrm = write_vrm(&avatar, &VrmMeta::default()).map_err(wrong)?;
        Ok(Product {
            files: vec![(folders.glb(), glb), (folders.vrm(), vrm)],
            result: json!({ "motion": moved.report }),
            ..Product::default()
        })
    })
}

/// Scan 0 with skeleton and weights as a GLB file.
///
/// # Errors
/// [`StudioError`] where the scan cannot be weighted.
pub fn rigged_scan(
    scan: &Mesh,
    weights: &SkinWeights,
    skeleton: &Skeleton,
    pose: &Pose,
) -> Result<Vec<u8>, StudioError> {
    let layer = AvatarLayer {
        name: "scan".into(),
        mesh: scan.clone(),
        weights: weights.clone(),
        order: 0,
        garment: None,
        thickness: None,
    };
    let avatar = Avatar {
        name: "rigged scan".into(),
        skeleton: skeleton.clone(),
        pose0: pose.clone(),
        layers: vec![layer],
        motions: Vec::new(),
    };
    write_glb(&avatar).map_err(|e| StudioError::stage(Path::new("rigged_scan.glb"), e))
}

/// The avatar at rest in scan 0's pose: the body and every garment.
fn dressed(run: &Run, body: &Body, types: &[Option<String>]) -> Result<Avatar, StudioError> {
    let folders = &run.folders;
    let mesh = run.read_mesh(&folders.body_mesh())?;
    let weights = body.skinned.weights.clone();
    let mut layers = vec![AvatarLayer { name: "body".into(), mesh, weights, order: 0, garment: None, thickness: None }];
    for (n, layer) in run.layers.iter().enumerate().filter(|(_, l)| run.garments().any(|g| g == l.as_str())) {
        let path = folders.garment(layer);
        let mut mesh = run.read_mesh(&path)?;
        let weights = take_weights(&mut mesh)
            .ok_or_else(|| StudioError::format(&path, "has no skin weights; delete it and run again"))?;
        let garment = types[n].clone();
        layers.push(AvatarLayer { name: layer.clone(), mesh, weights, order: n as u32, garment, thickness: None });
    }
    let (skeleton, pose0) = (body.skinned.skeleton.clone(), body.pose0.clone());
    Ok(Avatar { name: run.title().to_string(), skeleton, pose0, layers, motions: Vec::new() })
}

/// The told type of take `n`'s garment, else the one that the stage `cut` guessed.
fn garment_type(run: &Run, n: usize) -> Option<String> {
    let told = run.garment_type(n).map(|t| t.to_string());
    told.or_else(|| {
        let report: serde_json::Value =
            crate::pipeline::body_file::read_json(&run.folders.layer(&run.layers[n]).join("report.json")).ok()?;
        Some(report["stages"]["cut"]["result"]["garment_type"].as_str()?.to_string())
    })
}
