//! Fits primitives to a fitted body and writes them, with the surface in a pose:
//! `cargo run --release -p toile-implicit --example sculpt -- REST.ply BODY.json POSE.json OUT`.
//!
//! REST.ply, BODY.json and POSE.json are what `toile fit` writes as `rest.ply`, `body.json` and `pose.json`. OUT is a folder:
//! `body.toml`, `body.ply` in the pose, and level 3 of it, `body-3.ply`. The distances printed are to the skinned body.

#![allow(clippy::print_stdout)] // an example speaks to its reader

use std::{path::Path, time::Instant};

use nalgebra::Point3;
use toile_character::{BodyModel, Pose, Skeleton, SkinnedMesh, joint::JOINTS};
use toile_geometry::{bvh::Bvh, ply};
use toile_implicit::{Envelope, LEVELS, fit, format};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let files: Vec<String> = std::env::args().skip(1).collect();
    let [rest, json, pose, out] = &files[..] else {
        return Err("usage: sculpt REST.ply BODY.json POSE.json OUT".into());
    };
    let json: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(json)?)?;
    let pose: Pose = serde_json::from_str(&std::fs::read_to_string(pose)?)?;
    let model = BodyModel::load_default()?;
    let beta: Vec<f64> = serde_json::from_value(json["beta"].clone())?;
    let mut skeleton: Skeleton = model.skeleton_at(&beta);
    for joint in JOINTS {
        let place: [f64; 3] = serde_json::from_value(json["rest_joints"][joint.name()].clone())?;
        skeleton.rest[joint.index()] = Point3::from(place);
    }
    let body = SkinnedMesh::new(ply::read(Path::new(rest))?, skeleton, model.weights.clone())?;
    let begun = Instant::now();
    let poses = [pose.clone(), model.t_pose(&beta)];
    let fitted = fit::fit(&model, &body, &beta, "body", &poses, &fit::FitSettings::default())?;
    println!("fitted in {:.1} s", begun.elapsed().as_secs_f64());
    for step in &fitted.steps {
        println!("{} primitives: mean {:.2} mm, p95 {:.2} mm", step.primitives, 1e3 * step.mean, 1e3 * step.p95);
    }
    let text = format::write(&fitted.body);
    println!("{} bytes", text.len());
    std::fs::create_dir_all(out)?;
    std::fs::write(Path::new(out).join("body.toml"), &text)?;
    let read = format::read(&text, &model)?;
    let posed = body.posed(&pose);
    let bvh = Bvh::new(&posed, &body.mesh.triangles);
    for (k, level) in LEVELS.into_iter().enumerate() {
        let envelope = Envelope::new(&model, &read, level)?;
        let begun = Instant::now();
        let sampled = envelope.sample(&read, &pose);
        let milliseconds = begun.elapsed().as_secs_f64() * 1e3;
        let skin = &sampled.mesh.positions[..envelope.skin_count()];
        let mut off: Vec<f32> = skin.iter().filter_map(|p| bvh.closest(p, 1.0)).map(|c| 1e3 * c.distance).collect();
        off.sort_by(f32::total_cmp);
        println!(
            "level {k}: {} vertices of skin, {milliseconds:.1} ms, {} missed, mean {:.2} mm, p95 {:.2} mm, worst {:.1} mm",
            skin.len(),
            sampled.missed,
            off.iter().sum::<f32>() / off.len() as f32,
            off[off.len() * 95 / 100],
            off[off.len() - 1]
        );
        let name = if k == 0 { "body.ply".to_string() } else { format!("body-{k}.ply") };
        ply::write(&Path::new(out).join(name), &sampled.mesh)?;
    }
    Ok(())
}
