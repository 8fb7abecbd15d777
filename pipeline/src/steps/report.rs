//! Stage `report`: the page for the operator.
//!
//! Reads everything that was built; writes `report.html` in the subject's folder.

use std::{collections::BTreeMap, path::Path};

use serde::Deserialize;
use serde_json::{Value, json};
use toile_character::{Motion, SkinWeights, skinning};
use toile_fitting::{BodyMeasure, MeasureTable, ScanLandmark};
use toile_geometry::Mesh;

use crate::{
    PipelineError, Run,
    body_file::{Body, read_json},
    motion,
    report::{self, Contents, TakeRow},
    skin_attributes::take_weights,
    stage::{Product, Stage},
    summary::Summary,
};

/// Raised whenever the page looks different.
const VERSION: u32 = 5;
/// Expected seconds.
pub const COST: f64 = 4.0;
/// Times of the motion that are shown.
const FRAMES: usize = 4;

/// Writes the page, unless that is up to date.
///
/// # Errors
/// [`PipelineError`] where a file cannot be read or written or a picture cannot be drawn.
pub fn run(run: &Run, body: &Body, bvh: Option<&Path>, summary: &Summary) -> Result<(), PipelineError> {
    let folders = &run.folders;
    let garments: Vec<&str> = run.garments().collect();
    let mut inputs = vec![folders.body_mesh(), folders.body_json(), folders.measurements(), folders.glb()];
    inputs.extend(run.layers.iter().map(|l| folders.scan(l)));
    inputs.extend(garments.iter().map(|l| folders.garment(l)));
    let said = json!([summary.warnings, summary.lost, summary.failures, run.layers, run.title()]);
    let stage = Stage {
        name: "report",
        version: VERSION,
        cost: COST,
        root: &folders.root,
        folder: folders.build().join("report"),
        inputs,
        settings: said,
        outputs: vec![folders.report()],
        outputs_vary: true,
    };
    stage.run(&run.label("report", "draw"), run.observer, |progress| {
        let contents = contents(run, body, bvh, summary)?;
        let html = report::write(&contents, &folders.report(), progress)?;
        Ok(Product { files: vec![(folders.report(), html.into_bytes())], ..Product::default() })
    })?;
    Ok(())
}

/// Stature, girths and volume from `body.json`; `None` where there is no body yet.
pub fn measurements(run: &Run) -> Option<Value> {
    let body: Value = read_json(&run.folders.body_json()).ok()?;
    Some(json!({ "stature_m": body["stature_m"], "girths_m": body["girths_m"], "volume_m3": body["volume_m3"] }))
}

fn contents(run: &Run, body: &Body, bvh: Option<&Path>, summary: &Summary) -> Result<Contents, PipelineError> {
    let folders = &run.folders;
    let read_all = |layers: &[&str], path: &dyn Fn(&str) -> std::path::PathBuf| {
        layers.iter().map(|l| Ok((l.to_string(), run.read_mesh(&path(l))?))).collect::<Result<Vec<_>, PipelineError>>()
    };
    let takes: Vec<&str> = run.layers.iter().map(String::as_str).collect();
    let worn: Vec<&str> = run.garments().collect();
    let mut garments = read_all(&worn, &|l| folders.garment(l))?;
    let taken = |(layer, mesh): &mut (String, Mesh)| {
        take_weights(mesh)
            .ok_or_else(|| PipelineError::format(&folders.garment(layer), "has no skin weights; delete it"))
    };
    let weights: Vec<SkinWeights> = garments.iter_mut().map(taken).collect::<Result<_, _>>()?;
    let body_mesh = run.read_mesh(&folders.body_mesh())?;
    let moved = motion::load(bvh, &body.skinned.skeleton)?.motion;
    let table: MeasureTable = read_json(&folders.measurements())?;
    let found: Found = read_json(&folders.body_json())?;
    let floor = body_mesh.bounds().map_or(0.0, |(low, _)| f64::from(low.y));
    Ok(Contents {
        name: run.title().to_string(),
        subtitle: run.subtitle(),
        takes: takes.iter().map(|l| take_row(l, summary)).collect(),
        measurements: measurement_rows(&table),
        tapes: table.measures.into_iter().map(|m| m.path).collect(),
        sections: found.girths.into_iter().map(|(name, girth)| (name, floor + girth.height_m)).collect(),
        landmarks: found.landmarks,
        standing: run.read_mesh(&folders.standing())?,
        warnings: summary.warnings.clone(),
        lost: summary.lost.clone(),
        failures: summary.failures.clone(),
        scans: read_all(&takes, &|l| folders.scan(l))?,
        motion: motion_frames(body, &body_mesh, &garments, weights, &moved),
        body: body_mesh,
        gaps: gaps(&worn, summary),
        stacked: stacked(&worn, summary),
        garments,
        seconds: seconds(run),
    })
}

/// What the page shows of `body.json`.
#[derive(Deserialize)]
struct Found {
    landmarks: Vec<ScanLandmark>,
    girths: BTreeMap<String, At>,
}

/// Height of a girth above the soles, metres.
#[derive(Deserialize)]
struct At {
    height_m: f64,
}

/// What stacking says of each garment's gaps.
fn gaps(garments: &[&str], summary: &Summary) -> Vec<(String, Vec<f64>)> {
    let stacked = summary.stages.iter().find(|s| s.0 == "layers/stack").map_or(Value::Null, |s| s.1.result.clone());
    let shares = |k: usize| stacked["layers"][k]["gaps"].as_array().into_iter().flatten().filter_map(Value::as_f64);
    garments.iter().enumerate().map(|(k, l)| (l.to_string(), shares(k).collect())).collect()
}

/// How far stacking moved each garment, and what is left of crossings: then and in the walk.
fn stacked(garments: &[&str], summary: &Summary) -> Vec<Vec<String>> {
    let found = summary.stages.iter().find(|s| s.0 == "layers/stack").map_or(Value::Null, |s| s.1.result.clone());
    let text = |value: &Value, scale: f64, digits: usize| {
        value.as_f64().map_or("–".into(), |x| format!("{:.digits$}", scale * x))
    };
    let row = |(k, layer): (usize, &&str)| {
        let (rest, walk) = (&found["layers"][k], &found["walking"][k]);
        let own = |when: usize| rest["self_crossings"][when].as_f64();
        let added = own(0).zip(own(1)).map(|(before, after)| (after - before).max(0.0));
        vec![
            layer.to_string(),
            text(&rest["moved_seen_mean_m"], 1e3, 2),
            text(&rest["moved_seen_p95_m"], 1e3, 2),
            text(&rest["gap_m"], 1e3, 1),
            text(&rest["least_gap_m"], 1e3, 1),
            text(&rest["crossing_pairs"], 1.0, 0),
            text(&json!(added), 1.0, 0),
            text(&walk["crossing_pairs_mean"], 1.0, 0),
            text(&walk["touching_pairs_mean"], 1.0, 0),
            text(&walk["stretch_most"], 1.0, 1),
            text(&found["free_share"][k], 1e2, 0),
        ]
    };
    garments.iter().enumerate().map(row).collect()
}

/// What each take's records say, in figures.
fn take_row(layer: &str, summary: &Summary) -> TakeRow {
    let found = |stage: &str| {
        let key = format!("{layer}/{stage}");
        summary.stages.iter().find(|s| s.0 == key).map_or(Value::Null, |s| s.1.result.clone())
    };
    let (fuse, cut) = (found("fuse"), found("cut"));
    let number = |value: &Value, digits: usize| value.as_f64().map_or("–".into(), |x| format!("{x:.digits$}"));
    let percent = |value: &Value| value.as_f64().map_or("–".into(), |x| format!("{:.1}", 100.0 * x));
    let dropped = fuse["dropped"].as_array().map_or("–".into(), |d| d.len().to_string());
    let kind = cut["garment_type"].as_str().unwrap_or("–").to_string();
    let guessed = if cut["type_guessed"] == true { " (guessed)" } else { "" };
    TakeRow {
        layer: layer.to_string(),
        cells: vec![
            ("frames fused", number(&fuse["frames_fused"], 0)),
            ("left out", dropped),
            ("turned, °", number(&fuse["turned_deg"], 0)),
            ("residual, mm", number(&fuse["residual_mm"], 2)),
            ("seam, mm", number(&fuse["seam_after_mm"], 2)),
            ("unseen, %", number(&fuse["filled_percent"], 1)),
            ("garment", format!("{kind}{guessed}")),
            ("area, m²", number(&cut["area_m2"], 2)),
            ("filled, %", percent(&cut["filled_share"])),
            ("unsure, %", percent(&cut["unsure_share"])),
        ],
    }
}

fn measurement_rows(table: &MeasureTable) -> Vec<(String, String)> {
    let row = |m: &BodyMeasure| (m.name.clone(), format!("{:.1} cm", 100.0 * m.value_m));
    let mut rows: Vec<_> = table.measures.iter().map(row).collect();
    rows.push(("volume".into(), format!("{:.1} l", table.volume_l)));
    rows
}

/// All layers at a few times of the motion.
fn motion_frames(
    body: &Body,
    body_mesh: &Mesh,
    garments: &[(String, Mesh)],
    weights: Vec<SkinWeights>,
    motion: &Motion,
) -> Vec<(String, Vec<Mesh>)> {
    let skeleton = &body.skinned.skeleton;
    let mut layers: Vec<(&Mesh, SkinWeights)> = vec![(body_mesh, body.skinned.weights.clone())];
    layers.extend(garments.iter().map(|g| &g.1).zip(weights));
    let rest_from_pose0 = body.pose0.skinning_transforms(skeleton);
    let rest: Vec<_> = layers.iter().map(|(mesh, w)| skinning::unskin(&mesh.positions, w, &rest_from_pose0)).collect();
    let count = motion.poses.len();
    // A little more than a quarter each, so that a motion that repeats is not shown four times at the same phase.
    let shown = (0..FRAMES.min(count)).map(|k| k * 5 * count / (4 * FRAMES.max(1)) % count.max(1));
    let frame = |k: usize| {
        let transforms = motion.poses[k].skinning_transforms(skeleton);
        let posed = layers.iter().zip(&rest).map(|((mesh, weights), rest)| {
            let positions = skinning::skin(rest, weights, &transforms);
            let mut posed = Mesh { positions, normals: Vec::new(), ..(*mesh).clone() };
            posed.recompute_normals();
            posed
        });
        (format!("{} at {:.1} s", motion.name, k as f64 * motion.frame_time), posed.collect())
    };
    shown.map(frame).collect()
}

/// Seconds by folder and stage, as the timings files say.
fn seconds(run: &Run) -> BTreeMap<String, f64> {
    let folders = &run.folders;
    let places = run.layers.iter().map(|l| (l.clone(), folders.layer(l)));
    let others = [("body", folders.body()), ("layers", folders.layers()), ("avatar", folders.avatar())];
    let mut all = BTreeMap::new();
    for (name, folder) in places.chain(others.map(|(n, f)| (n.to_string(), f))) {
        let timings: BTreeMap<String, Value> = read_json(&folder.join("timings.json")).unwrap_or_default();
        all.extend(timings.iter().filter_map(|(stage, t)| Some((format!("{name}: {stage}"), t["seconds"].as_f64()?))));
    }
    all
}
