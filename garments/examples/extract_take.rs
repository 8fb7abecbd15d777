//! Extracts the garments of a processed subject again and stacks them, by the default way or by the seed's: a tool to
//! develop with.
//!
//!     cargo run --release -p toile-garments --example extract_take -- BUILD OUT [--no-stack] [--seed-way]
//!
//! BUILD is a subject's build folder with scans, poses and the body. OUT gets garments in the same layout, and for each
//! take `labels.ply`: the scan with what was decided as vertex attributes. Types are those that the layers' names say;
//! others are guessed. `--seed-way` labels by the nearest body vertex and pushes out along normals (Hu et al. 2017, §6.2
//! and eq. 7).
#![allow(clippy::print_stdout)] // a developer's tool

use std::{error::Error, path::Path, time::Instant};

use toile_character::{BodyModel, Pose, SkinWeights, SkinnedMesh, skinning, transfer::closest_triangle_weights};
use toile_garments::{
    DressedTake, ExtractSettings, Extraction, GarmentType, Labelling, StackMethod, StackSettings, extract, stack,
};
use toile_geometry::{Mesh, ply};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut has = |flag: &str| {
        let count = arguments.len();
        arguments.retain(|a| a != flag);
        arguments.len() < count
    };
    let (stacks, seed_way) = (!has("--no-stack"), has("--seed-way"));
    let [input, output] = &arguments[..] else {
        return Err("usage: extract_take BUILD OUT [--no-stack] [--seed-way]".into());
    };
    let (input, output) = (Path::new(input), Path::new(output));
    let mut layers: Vec<String> = std::fs::read_dir(input)?
        .filter_map(|e| e.ok()?.file_name().into_string().ok())
        .filter(|n| n.as_bytes().first().is_some_and(u8::is_ascii_digit))
        .collect();
    layers.sort();
    let subject = Subject::load(input, &layers)?;
    let mut garments = Vec::new();
    for n in 1..layers.len() {
        garments.push(subject.take(input, &layers, n, &output.join(&layers[n]), seed_way)?);
    }
    let body0 = subject.body.posed_mesh(&subject.poses[0]);
    for (layer, mesh) in layers[1..].iter().zip(&garments) {
        ply::write(&output.join(layer).join("unstacked.ply"), mesh)?;
    }
    if stacks {
        stack_all(&body0, &mut garments, seed_way)?;
    }
    std::fs::create_dir_all(output.join("body"))?;
    ply::write(&output.join("body/body.ply"), &body0)?;
    for (layer, mesh) in layers[1..].iter().zip(&garments) {
        ply::write(&output.join(layer).join("garment.ply"), mesh)?;
    }
    Ok(())
}

fn stack_all(body: &Mesh, garments: &mut [Mesh], seed_way: bool) -> Result<(), Box<dyn Error>> {
    let method = if seed_way { StackMethod::PushAlongNormal } else { StackMethod::Regions };
    let settings = StackSettings { method, ..StackSettings::default() };
    let (thickness, clock) = (vec![0.001; garments.len()], Instant::now());
    let report = stack(body, garments, &thickness, &settings, &|_| ())?;
    println!("stacked in {:.2} s", clock.elapsed().as_secs_f32());
    report.layers.iter().for_each(|l| println!("  {l:?}"));
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

    fn take(
        &self,
        input: &Path,
        layers: &[String],
        n: usize,
        out: &Path,
        seed_way: bool,
    ) -> Result<Mesh, Box<dyn Error>> {
        let scan = ply::read(&input.join(&layers[n]).join("scan.ply"))?;
        let previous = self.previous(ply::read(&input.join(&layers[n - 1]).join("scan.ply"))?, n);
        let take = DressedTake {
            scan: &scan,
            is_first: false,
            previous: &previous,
            body: &self.body.posed_mesh(&self.poses[n]),
            weights: &self.body.weights,
            skeleton: &self.body.skeleton,
            pose: &self.poses[n],
            pose0: &self.poses[0],
            garment_type: garment_type(&layers[n]),
            edits: None,
        };
        let labelling = if seed_way { Labelling::NearestBodyVertex } else { Labelling::GraphCut };
        let settings = ExtractSettings { labelling, ..ExtractSettings::default() };
        let clock = Instant::now();
        let found = extract(&take, &settings, &|_| ())?;
        println!("{} in {:.2} s: {:?}", layers[n], clock.elapsed().as_secs_f32(), found.report);
        found.warnings.iter().for_each(|w| println!("  warning: {w}"));
        write(&take, &found, out)?;
        Ok(found.garment)
    }
}

/// The type that a layer's name says.
fn garment_type(layer: &str) -> Option<GarmentType> {
    layer.split_once('-').map_or(layer, |n| n.1).parse().ok()
}

fn write(take: &DressedTake, found: &Extraction, out: &Path) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(out)?;
    ply::write(&out.join("scan.ply"), take.scan)?;
    ply::write(&out.join("previous.ply"), take.previous)?;
    ply::write(&out.join("cut.ply"), &found.in_take)?;
    let mut labels = take.scan.clone();
    let garment = found.labels.garment.iter().map(|&g| f32::from(u8::from(g))).collect();
    let reason = found.labels.reasons.iter().map(|r| f32::from(*r as u8)).collect();
    for (name, values) in [
        ("garment", garment),
        ("odds", found.labels.log_odds.clone()),
        ("confidence", found.labels.confidence.clone()),
        ("reason", reason),
    ] {
        labels.attributes.insert(name.into(), values);
    }
    ply::write(&out.join("labels.ply"), &labels)?;
    Ok(())
}
