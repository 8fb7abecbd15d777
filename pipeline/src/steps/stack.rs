//! Stage `stack`: every garment outside the body and all garments below it.
//!
//! Reads the body and each `unstacked.ply`. Writes each `garment.ply`, in scan 0's pose and frame, with its skin weights
//! as vertex attributes; layers that lie close over one another have like weights.

use serde_json::json;
use toile_character::{Pose, SkinWeights};
use toile_garments::{
    FREE_PART, LayerReport, PosedReport, StackSettings, TORN, Worn, carry_weights, posed_report, stack,
};
use toile_geometry::{Mesh, ply};

use crate::{
    PipelineError, Run,
    body_file::Body,
    garment::thickness,
    motion,
    skin_attributes::{take_weights, with_weights},
    stage::{Product, Record, Stage, plain},
};

/// Raised whenever the same inputs and settings give other garments.
const VERSION: u32 = 8;
/// Expected seconds for each garment.
pub const COST: f64 = 1.5;
/// Poses of the shipped walk in which crossings are counted.
const POSES: usize = 4;

/// Stacks all garments, unless they are up to date.
///
/// # Errors
/// [`PipelineError`] where a mesh is broken, or files cannot be read or written.
pub fn run(run: &Run, body: &Body) -> Result<Record, PipelineError> {
    let folders = &run.folders;
    let garments: Vec<&str> = run.garments().collect();
    let thickness: Vec<f32> = run.garment_numbers().map(|n| thickness(run, n)).collect::<Result<_, _>>()?;
    let settings = StackSettings::default();
    let of_body = [folders.body_mesh(), folders.body_json(), folders.pose(run.first_layer())];
    let inputs = of_body.into_iter().chain(garments.iter().map(|l| folders.unstacked(l))).collect();
    let stage = Stage {
        name: "stack",
        version: VERSION,
        cost: COST * garments.len() as f64,
        root: &folders.root,
        folder: folders.layers(),
        inputs,
        settings: json!({ "stack": plain(&settings)?, "thickness_m": plain(&thickness)? }),
        outputs: garments.iter().map(|l| folders.garment(l)).collect(),
        outputs_vary: false,
    };
    stage.run(&run.label("layers", "stack"), run.observer, |progress| {
        let body_mesh = run.read_mesh(&folders.body_mesh())?;
        let (mut layers, mut weights): (Vec<Mesh>, Vec<SkinWeights>) =
            garments.iter().map(|l| garment(run, l)).collect::<Result<Vec<_>, _>>()?.into_iter().unzip();
        let wrong = |e| PipelineError::stage(&folders.root, e);
        let report = stack(&body_mesh, &mut layers, &thickness, &settings, progress).map_err(wrong)?;
        carry_weights(&layers, &mut weights, &body.skinned.skeleton, &body.pose0).map_err(wrong)?;
        let walking = walking(body, &body_mesh, &layers, &weights)?;
        let encoded = layers.iter().zip(&weights).map(|(mesh, w)| ply::encode(&with_weights(mesh, w)));
        let files = garments.iter().map(|l| folders.garment(l)).zip(encoded).collect();
        let told = garments.iter().zip(&report.layers).zip(&walking);
        let warnings = told.flat_map(|((l, report), walking)| warnings(l, report, walking)).collect();
        let free: Vec<Option<f32>> = layers.iter().map(free_share).collect();
        let result =
            json!({ "layers": plain(&report.layers)?, "walking": plain(&walking)?, "free_share": plain(&free)? });
        Ok(Product { files, result, warnings, ..Product::default() })
    })
}

fn garment(run: &Run, layer: &str) -> Result<(Mesh, SkinWeights), PipelineError> {
    let path = run.folders.unstacked(layer);
    let mut mesh = run.read_mesh(&path)?;
    let weights =
        take_weights(&mut mesh).ok_or_else(|| PipelineError::format(&path, "has no skin weights; delete it"))?;
    Ok((mesh, weights))
}

/// Share of a skirt's or dress's vertices that hang free of the body.
fn free_share(mesh: &Mesh) -> Option<f32> {
    let free = mesh.attributes.get(FREE_PART)?;
    Some(free.iter().sum::<f32>() / free.len().max(1) as f32)
}

/// What the layers do in the shipped walk by their weights alone.
fn walking(
    body: &Body,
    body_mesh: &Mesh,
    layers: &[Mesh],
    weights: &[SkinWeights],
) -> Result<Vec<PosedReport>, PipelineError> {
    let skeleton = &body.skinned.skeleton;
    let walk = motion::load(None, skeleton)?.motion.poses;
    // A little more than a quarter each, so that a walk that repeats is not looked at in one phase alone.
    let at = |k: usize| k * 5 * walk.len() / (4 * POSES) % walk.len();
    let poses: Vec<Pose> = (0..POSES.min(walk.len())).map(|k| walk[at(k)].clone()).collect();
    let mut worn = vec![Worn { mesh: body_mesh, weights: &body.skinned.weights }];
    worn.extend(layers.iter().zip(weights).map(|(mesh, weights)| Worn { mesh, weights }));
    Ok(posed_report(&worn, skeleton, &body.pose0, &poses).split_off(1))
}

/// What is to be looked at: in the pose of the scans, and in the walk.
fn warnings(layer: &str, report: &LayerReport, walking: &PosedReport) -> Vec<String> {
    let (pairs, cut, [before, after]) = (report.crossing_pairs, report.cut_triangles, report.self_crossings);
    let torn = walking.torn_most;
    let told = [
        (pairs > 0, format!("{pairs} pairs of triangles still cut through a layer below")),
        (cut > 0, format!("{cut} triangles were cut out because they crossed a layer below")),
        (after > before, format!("stacking left {after} pairs of its triangles crossing each other, {before} before")),
        (torn > 0, format!("{torn} triangles stretch more than {TORN:.0} times in the walk")),
    ];
    told.into_iter().filter(|(is_so, _)| *is_so).map(|(_, what)| format!("{layer}: {what}")).collect()
}
