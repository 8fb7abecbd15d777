//! Stacks the garments of a processed subject again, and walks in them: a tool to develop with.
//!
//!     cargo run --release -p toile-garments --example stack_layers -- BUILD OUT [MOTION.bvh ...]
//!
//! BUILD is a subject's build folder with `body/` and each layer's `unstacked.ply`. OUT gets the body and the garments
//! in the same layout. Each motion is tried on the stacked layers, in all frames, by their skin weights alone; crossings
//! between layers and stretch are printed.
#![allow(clippy::print_stdout)] // a developer's tool

use std::{error::Error, path::Path, time::Instant};

use toile_animation::{RetargetSettings, bvh, retarget};
use toile_character::{BodyModel, Pose, Skeleton, SkinWeights};
use toile_garments::{GarmentType, StackSettings, Worn, carry_weights, cloth_thickness, posed_report, stack};
use toile_geometry::{Mesh, ply};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input, output, motions @ ..] = &arguments[..] else {
        return Err("usage: stack_layers BUILD OUT [MOTION.bvh ...]".into());
    };
    let (input, output) = (Path::new(input), Path::new(output));
    let mut names: Vec<String> = std::fs::read_dir(input)?
        .filter_map(|e| e.ok()?.file_name().into_string().ok())
        .filter(|n| input.join(n).join("unstacked.ply").exists())
        .collect();
    names.sort();
    let body = ply::read(&input.join("body/body.ply"))?;
    let read = |n: &String| ply::read(&input.join(n).join("unstacked.ply"));
    let mut layers: Vec<Mesh> = names.iter().map(read).collect::<Result<_, _>>()?;
    let thickness: Vec<f32> = names.iter().map(|n| thickness(n)).collect();
    let clock = Instant::now();
    let report = stack(&body, &mut layers, &thickness, &StackSettings::default(), &|_| ())?;
    println!("stacked in {:.2} s", clock.elapsed().as_secs_f32());
    report.layers.iter().zip(&names).for_each(|(l, n)| println!("  {n}: {l:?}"));
    std::fs::create_dir_all(output.join("body"))?;
    ply::write(&output.join("body/body.ply"), &body)?;
    for (name, mesh) in names.iter().zip(&layers) {
        std::fs::create_dir_all(output.join(name))?;
        ply::write(&output.join(name).join("garment.ply"), mesh)?;
    }
    if motions.is_empty() { Ok(()) } else { walk(input, &names, &body, &layers, motions) }
}

/// The thickness of a layer by its name.
fn thickness(name: &str) -> f32 {
    let kind = name.split_once('-').map_or(name, |n| n.1);
    cloth_thickness(kind.parse().unwrap_or(GarmentType::Other))
}

fn walk(
    input: &Path,
    names: &[String],
    body: &Mesh,
    layers: &[Mesh],
    motions: &[String],
) -> Result<(), Box<dyn Error>> {
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(input.join("body/body.json"))?)?;
    let beta: Vec<f64> = serde_json::from_value(json["beta"].clone())?;
    let model = BodyModel::load_default()?;
    let skeleton: Skeleton = model.skeleton_at(&beta);
    let pose0: Pose = serde_json::from_slice(&std::fs::read(input.join("00-body/pose.json"))?)?;
    let mut weights: Vec<SkinWeights> = layers.iter().map(weights_of).collect::<Option<_>>().ok_or("no weights")?;
    let clock = Instant::now();
    carry_weights(layers, &mut weights, &skeleton, &pose0)?;
    println!("weights carried in {:.2} s", clock.elapsed().as_secs_f32());
    let mut worn = vec![Worn { mesh: body, weights: &model.weights }];
    worn.extend(layers.iter().zip(&weights).map(|(mesh, weights)| Worn { mesh, weights }));
    for path in motions {
        let motion = retarget(&bvh::read(Path::new(path))?, "motion", &skeleton, &RetargetSettings::default())?.motion;
        println!("{path}: {} poses", motion.poses.len());
        let reports = posed_report(&worn, &skeleton, &pose0, &motion.poses);
        reports[1..].iter().zip(names).for_each(|(r, n)| println!("  {n}: {r:?}"));
    }
    Ok(())
}

/// The weights that a garment's file holds as attributes.
fn weights_of(mesh: &Mesh) -> Option<SkinWeights> {
    let column = |name: &str, k: usize| mesh.attributes.get(&format!("{name}{k}"));
    let mut weights = SkinWeights::default();
    for v in 0..mesh.positions.len() {
        let influence = |k: usize| Some((*column("joint", k)?.get(v)? as u8, *column("weight", k)?.get(v)?));
        weights.push(&(0..4).map(influence).collect::<Option<Vec<_>>>()?);
    }
    Some(weights)
}
