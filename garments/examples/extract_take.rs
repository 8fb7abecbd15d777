//! Takes garments out of prepared folders and stacks them: a tool to develop with.
//!
//!     cargo run --release -p toile-garments --example extract_take -- IN OUT [TYPE...]
//!
//! IN holds a folder a take in order; the first holds body.ply and rig.json, the others scan.ply, previous.ply (what was
//! worn before, posed into the scan), body.ply and rig.json. body.ply carries the skin weights as attributes j0..j3,
//! w0..w3; rig.json is {"skeleton": [[x, y, z]; 52], "pose": ..}. OUT gets the layout of a subject's build folder.

use std::{
    error::Error,
    path::{Path, PathBuf},
    time::Instant,
};

use nalgebra::Point3;
use toile_character::{Pose, Skeleton, SkinWeights};
use toile_garments::{ExtractSettings, GarmentType, StackSettings, Take, extract, stack};
use toile_geometry::{Mesh, ply};

struct Rigged {
    body: Mesh,
    weights: SkinWeights,
    skeleton: Skeleton,
    pose: Pose,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (input, output) = (PathBuf::from(&arguments[0]), PathBuf::from(&arguments[1]));
    let mut takes: Vec<PathBuf> = std::fs::read_dir(&input)?.map(|e| e.map(|e| e.path())).collect::<Result<_, _>>()?;
    takes.retain(|p| p.is_dir());
    takes.sort();
    let first = rigged(&takes[0])?;
    std::fs::create_dir_all(output.join("body"))?;
    ply::write(&output.join("body/body.ply"), &Mesh::new(first.body.positions.clone(), first.body.triangles.clone()))?;
    let mut layers = Vec::new();
    for (n, folder) in takes.iter().enumerate().skip(1) {
        let told = arguments.get(1 + n).and_then(|t| t.parse::<GarmentType>().ok());
        layers.push(one_take(folder, &first, told, &output)?);
    }
    let clock = Instant::now();
    let report = stack(&first.body, &mut layers, &StackSettings::default(), &|_| ())?;
    let seconds = clock.elapsed().as_secs_f32();
    println!("stacked in {seconds:.2} s");
    report.layers.iter().for_each(|l| println!("  {l:?}"));
    for (folder, mesh) in takes[1..].iter().zip(&layers) {
        ply::write(&output.join(folder.file_name().unwrap_or_default()).join("garment.ply"), mesh)?;
    }
    Ok(())
}

fn one_take(folder: &Path, first: &Rigged, told: Option<GarmentType>, output: &Path) -> Result<Mesh, Box<dyn Error>> {
    let scan = ply::read(&folder.join("scan.ply"))?;
    let previous = ply::read(&folder.join("previous.ply"))?;
    let here = rigged(folder)?;
    let take = Take {
        scan: &scan,
        previous: &previous,
        body: &here.body,
        weights: &here.weights,
        skeleton: &first.skeleton,
        pose: &here.pose,
        pose0: &first.pose,
        garment_type: told,
    };
    let clock = Instant::now();
    let step = |share: f32| println!("  {share:.1} after {:.2} s", clock.elapsed().as_secs_f32());
    let found = extract(&take, &ExtractSettings::default(), &step)?;
    println!("{} in {:.2} s: {:?}", folder.display(), clock.elapsed().as_secs_f32(), found.report);
    found.warnings.iter().for_each(|w| println!("  warning: {w}"));
    let out = output.join(folder.file_name().unwrap_or_default());
    std::fs::create_dir_all(&out)?;
    ply::write(&out.join("scan.ply"), &scan)?;
    ply::write(&out.join("garment_in_take.ply"), &found.in_take)?;
    ply::write(&out.join("garment_unstacked.ply"), &found.garment)?;
    let mut labelled = scan.clone();
    let f = |g: &bool| f32::from(u8::from(*g));
    labelled.attributes.insert("garment".into(), found.labels.garment.iter().map(f).collect());
    labelled.attributes.insert("odds".into(), found.labels.log_odds.clone());
    labelled.attributes.insert("confidence".into(), found.labels.confidence);
    if let Some(path) = std::env::var_os("EVIDENCE") {
        let graph = toile_garments::scan_graph::ScanGraph::new(&scan);
        let e = toile_garments::evidence::measure(&take, &graph, &ExtractSettings::default());
        let _ = path;
        for (name, values) in [("height", e.height), ("color", e.color), ("facing", e.facing)] {
            labelled.attributes.insert(name.into(), values);
        }
    }
    ply::write(&out.join("labels.ply"), &labelled)?;
    Ok(found.garment)
}

fn rigged(folder: &Path) -> Result<Rigged, Box<dyn Error>> {
    let body = ply::read(&folder.join("body.ply"))?;
    let mut weights = SkinWeights::default();
    for v in 0..body.positions.len() {
        let of = |name: &str, k: usize| body.attributes.get(&format!("{name}{k}")).map_or(0.0, |a| a[v]);
        weights.push(&std::array::from_fn::<_, 4, _>(|k| (of("j", k) as u8, of("w", k))));
    }
    let rig: serde_json::Value = serde_json::from_slice(&std::fs::read(folder.join("rig.json"))?)?;
    let rest: Vec<[f64; 3]> = serde_json::from_value(rig["skeleton"].clone())?;
    let mut joints = [Point3::origin(); toile_character::JOINT_COUNT];
    joints.iter_mut().zip(rest).for_each(|(j, p)| *j = Point3::from(p));
    let pose: Pose = serde_json::from_value(rig["pose"].clone())?;
    Ok(Rigged { body, weights, skeleton: Skeleton { rest: joints }, pose })
}
