//! Takes the garments of a processed subject out again and stacks them: a tool to develop with.
//!
//!     cargo run --release -p toile-garments --example extract_take -- BUILD OUT [--no-stack]
//!
//! BUILD is a subject's build folder with scans, poses and the body. OUT gets garments in the same layout, and for each
//! take `labels.ply`: the scan with what was measured and decided as vertex attributes. All types are guessed.
#![allow(clippy::print_stdout)] // a developer's tool

use std::{error::Error, path::Path, time::Instant};

use toile_character::{BodyModel, Pose, SkinWeights, SkinnedMesh, skinning, transfer::closest_triangle_weights};
use toile_garments::{
    ExtractSettings, Extraction, StackSettings, Take, evidence, extract, scan_graph::ScanGraph, stack,
};
use toile_geometry::{Mesh, ply};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let stacks = arguments.pop_if(|a| a == "--no-stack").is_none();
    let [input, output] = &arguments[..] else { return Err("usage: extract_take BUILD OUT [--no-stack]".into()) };
    let (input, output) = (Path::new(input), Path::new(output));
    let mut layers: Vec<String> = std::fs::read_dir(input)?
        .filter_map(|e| e.ok()?.file_name().into_string().ok())
        .filter(|n| n.as_bytes().first().is_some_and(u8::is_ascii_digit))
        .collect();
    layers.sort();
    let subject = Subject::load(input, &layers)?;
    let mut garments = Vec::new();
    for n in 1..layers.len() {
        garments.push(subject.take(input, &layers, n, &output.join(&layers[n]))?);
    }
    let body0 = subject.body.posed_mesh(&subject.poses[0]);
    for (layer, mesh) in layers[1..].iter().zip(&garments) {
        ply::write(&output.join(layer).join("unstacked.ply"), mesh)?;
    }
    let clock = Instant::now();
    if stacks {
        let report = stack(&body0, &mut garments, &vec![0.001; layers.len() - 1], &StackSettings::default(), &|_| ())?;
        println!("stacked in {:.2} s", clock.elapsed().as_secs_f32());
        report.layers.iter().for_each(|l| println!("  {l:?}"));
    }
    std::fs::create_dir_all(output.join("body"))?;
    ply::write(&output.join("body/body.ply"), &body0)?;
    for (layer, mesh) in layers[1..].iter().zip(&garments) {
        ply::write(&output.join(layer).join("garment.ply"), mesh)?;
    }
    Ok(())
}

struct Subject {
    body: SkinnedMesh,
    poses: Vec<Pose>,
}

impl Subject {
    fn load(input: &Path, layers: &[String]) -> Result<Self, Box<dyn Error>> {
        let model = BodyModel::load_default()?;
        let json: serde_json::Value = serde_json::from_slice(&std::fs::read(input.join("body/body.json"))?)?;
        let beta: Vec<f64> = serde_json::from_value(json["beta"].clone())?;
        let rest = ply::read(&input.join("body/rest.ply"))?;
        let body = SkinnedMesh::new(rest, model.skeleton_at(&beta), model.weights.clone())?;
        let pose = |layer: &String| -> Result<Pose, Box<dyn Error>> {
            Ok(serde_json::from_slice(&std::fs::read(input.join(layer).join("pose.json"))?)?)
        };
        Ok(Self { body, poses: layers.iter().map(pose).collect::<Result<_, _>>()? })
    }

    /// The scan of take n − 1 posed as take n.
    fn previous(&self, mut scan: Mesh, n: usize) -> Mesh {
        let transforms = |k: usize| self.poses[k].skinning_transforms(&self.body.skeleton);
        let body = self.body.posed_mesh(&self.poses[n - 1]);
        let weights: SkinWeights = closest_triangle_weights(&body, &self.body.weights, &scan.positions);
        let rest = skinning::unskin(&scan.positions, &weights, &transforms(n - 1));
        scan.positions = skinning::skin(&rest, &weights, &transforms(n));
        scan
    }

    fn take(&self, input: &Path, layers: &[String], n: usize, out: &Path) -> Result<Mesh, Box<dyn Error>> {
        let scan = ply::read(&input.join(&layers[n]).join("scan.ply"))?;
        let previous = self.previous(ply::read(&input.join(&layers[n - 1]).join("scan.ply"))?, n);
        let take = Take {
            scan: &scan,
            previous: &previous,
            body: &self.body.posed_mesh(&self.poses[n]),
            weights: &self.body.weights,
            skeleton: &self.body.skeleton,
            pose: &self.poses[n],
            pose0: &self.poses[0],
            garment_type: None,
            edits: None,
        };
        let clock = Instant::now();
        let found = extract(&take, &ExtractSettings::default(), &|_| ())?;
        println!("{} in {:.2} s: {:?}", layers[n], clock.elapsed().as_secs_f32(), found.report);
        found.warnings.iter().for_each(|w| println!("  warning: {w}"));
        write(&take, &found, out)?;
        Ok(found.garment)
    }
}

fn write(take: &Take, found: &Extraction, out: &Path) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(out)?;
    ply::write(&out.join("scan.ply"), take.scan)?;
    ply::write(&out.join("previous.ply"), take.previous)?;
    ply::write(&out.join("cut.ply"), &found.in_take)?;
    let measured = evidence::measure(take, &ScanGraph::new(take.scan), &ExtractSettings::default());
    let mut labels = take.scan.clone();
    let garment = found.labels.garment.iter().map(|&g| f32::from(u8::from(g))).collect();
    for (name, values) in [
        ("garment", garment),
        ("odds", found.labels.log_odds.clone()),
        ("confidence", found.labels.confidence.clone()),
        ("height", measured.height),
        ("color", measured.color),
        ("facing", measured.facing),
    ] {
        labels.attributes.insert(name.into(), values);
    }
    ply::write(&out.join("labels.ply"), &labels)?;
    Ok(())
}
