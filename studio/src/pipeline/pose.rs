//! Stage `pose`: the body inside the scan of a dressed take.
//!
//! Reads the scan, the scan of the take before with its pose, the pose of the first take, and the body. Writes `pose.json` and `body.ply`.

use serde_json::json;
use toile_character::BodyModel;
use toile_fitting::{UnderFit, UnderSettings, Verdict, pose_under, rigged_scan, settle_under};
use toile_geometry::{Mesh, ply};

use crate::{
    StudioError,
    pipeline::{
        Run,
        body_file::{Body, pose_bytes, read_pose},
    },
    stage::{Product, Record, Stage, plain},
};

/// Raised whenever the same inputs and settings give another pose.
const VERSION: u32 = 4;
/// Expected seconds.
pub const COST: f64 = 2.0;

/// Poses the body inside take `n` (1 or more), unless that is up to date.
///
/// # Errors
/// [`StudioError`] where the dressed person cannot be found in the scan, or files cannot be read or written.
pub fn run(run: &Run, n: usize, body: &Body, model: &BodyModel) -> Result<Record, StudioError> {
    let folders = &run.folders;
    let (layer, before) = (run.layers[n].as_str(), run.layers[n - 1].as_str());
    let settings = UnderSettings::default();
    let (scan_path, pose_path, body_path) = (folders.scan(layer), folders.pose(layer), folders.posed_body(layer));
    let stage = Stage {
        name: "pose",
        version: VERSION,
        cost: COST,
        root: &folders.root,
        folder: folders.layer(layer),
        inputs: vec![
            scan_path.clone(),
            folders.scan(before),
            folders.pose(before),
            folders.pose(run.first_layer()),
            folders.body_rest(),
            folders.body_json(),
        ],
        settings: plain(&settings)?,
        outputs: vec![pose_path.clone(), body_path.clone()],
        outputs_vary: false,
    };
    stage.run(&run.label(layer, "pose"), run.progress, |progress| {
        let (scan, scan_before) = (run.read_mesh(&scan_path)?, run.read_mesh(&folders.scan(before))?);
        let pose_before = read_pose(&folders.pose(before))?;
        let habit = read_pose(&folders.pose(run.first_layer()))?;
        let dressed = rigged_scan(&scan_before, &body.skinned, &pose_before);
        // limbs are drawn to how they were seen undressed: what clothes hide goes astray a little in each take
        let fit = pose_under(&dressed, &trust(&scan_before), &habit, &scan, &settings, progress)
            .map_err(|e| StudioError::stage(&scan_path, e))?;
        if fit.report.verdict == Verdict::Failed {
            let reason =
                format!("the person of the take before was not found in it: {}", fit.report.reasons.join("; "));
            return Err(StudioError::stage(&scan_path, reason));
        }
        let settled =
            settle_under(model, &body.skinned, &fit.pose, &scan).map_err(|e| StudioError::stage(&scan_path, e))?;
        Ok(Product {
            files: vec![
                (pose_path.clone(), pose_bytes(&settled.pose)?),
                (body_path.clone(), ply::encode(&settled.mesh)),
            ],
            warnings: warnings(layer, &fit),
            result: json!({ "pose": plain(&fit.report)?, "settle": plain(&settled.report)? }),
            ..Product::default()
        })
    })
}

/// What fusion closed without seeing it does not tell where the person is.
fn trust(scan: &Mesh) -> Vec<f32> {
    match scan.attributes.get("filled") {
        Some(filled) => filled.iter().map(|f| 1.0 - f.clamp(0.0, 1.0)).collect(),
        None => vec![1.0; scan.positions.len()],
    }
}

fn warnings(layer: &str, fit: &UnderFit) -> Vec<String> {
    fit.report.reasons.iter().map(|r| format!("{layer}: pose: {r}")).collect()
}
