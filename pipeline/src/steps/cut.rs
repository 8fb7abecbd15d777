//! Stage `cut`: the new garment out of a dressed take's scan.
//!
//! Reads the scan, the scan of the take that it is compared with, both poses, the body, and the layer's edits where there are any. Writes `cut.ply`, the garment in the take's
//! own pose and frame, and `unstacked.ply`, the same in the common frame with its skin weights as vertex attributes. Both are
//! empty where nothing new is worn: the record then tells of a failure, and the layer is left out.

use std::path::Path;

use serde_json::json;
use toile_fitting::rigged_scan;
use toile_garments::{Edits, ExtractSettings, Extraction, Take, Warning, extract};
use toile_geometry::ply;

use crate::{
    PipelineError, Run,
    body_file::{Body, read_pose},
    skin_attributes::with_weights,
    stage::{Product, Record, Stage, plain},
};

/// Raised whenever the same inputs and settings give another garment.
const VERSION: u32 = 7;
/// Expected seconds.
pub const COST: f64 = 3.0;

/// Cuts what take `n` (1 or more) wears and take `worn_as` does not, unless that is up to date.
///
/// # Errors
/// [`PipelineError`] where a mesh is broken, or files cannot be read or written.
pub fn run(run: &Run, n: usize, worn_as: usize, body: &Body) -> Result<Record, PipelineError> {
    let told = run.garment_type(n);
    let folders = &run.folders;
    let (layer, before) = (run.layers[n].as_str(), run.layers[worn_as].as_str());
    let settings = ExtractSettings::default();
    let paths = [layer, before].map(|l| (folders.scan(l), folders.pose(l)));
    let edits_path = Some(folders.edits(layer)).filter(|p| p.exists());
    let edits = edits_path.as_deref().map(read_edits).transpose()?;
    let decides = [
        paths[0].0.clone(),
        paths[0].1.clone(),
        paths[1].0.clone(),
        paths[1].1.clone(),
        folders.body_rest(),
        folders.body_json(),
        folders.pose(run.first_layer()),
    ];
    let stage = Stage {
        name: "cut",
        version: VERSION,
        cost: COST,
        root: &folders.root,
        folder: folders.layer(layer),
        inputs: decides.into_iter().chain(edits_path).collect(),
        settings: json!({ "extract": plain(&settings)?, "type": told }),
        outputs: vec![folders.cut(layer), folders.unstacked(layer)],
        outputs_vary: false,
    };
    stage.run(&run.label(layer, "cut"), run.observer, |progress| {
        let [(scan, pose), (scan_before, pose_before)] = &paths;
        let (scan, scan_before) = (run.read_mesh(scan)?, run.read_mesh(scan_before)?);
        let (pose, pose_before) = (read_pose(pose)?, read_pose(pose_before)?);
        let take = Take {
            scan: &scan,
            previous: &rigged_scan(&scan_before, &body.skinned, &pose_before).posed_mesh(&pose),
            body: &body.skinned.posed_mesh(&pose),
            weights: &body.skinned.weights,
            skeleton: &body.skinned.skeleton,
            pose: &pose,
            pose0: &body.pose0,
            garment_type: told,
            edits: edits.as_ref(),
        };
        let found = extract(&take, &settings, progress).map_err(|e| PipelineError::stage(&paths[0].0, e))?;
        product(run, layer, &found)
    })
}

/// Reads and checks a layer's edits.
///
/// # Errors
/// [`PipelineError::Format`] where the file is not a valid edits file, and why.
pub fn read_edits(path: &Path) -> Result<Edits, PipelineError> {
    let bytes = std::fs::read(path).map_err(|e| PipelineError::io(path, e))?;
    Edits::from_json(&bytes).map_err(|e| PipelineError::format(path, e))
}

fn product(run: &Run, layer: &str, found: &Extraction) -> Result<Product, PipelineError> {
    let (nothing, other): (Vec<_>, Vec<_>) = found.warnings.iter().partition(|w| **w == Warning::NothingNew);
    let left_out = |w| {
        format!(
            "{}: {w}; the avatar goes without it; record it again and import it with --retake",
            run.take(layer).display()
        )
    };
    let mut warnings: Vec<String> = other.into_iter().map(|w| format!("{layer}: {w}")).collect();
    if found.report.unsure_share > UNSURE_SHARE {
        let percent = 100.0 * found.report.unsure_share;
        warnings.push(format!(
            "{layer}: {percent:.0} % of the garment could as well be what was worn before; look at its hem"
        ));
    }
    Ok(Product {
        files: vec![
            (run.folders.cut(layer), ply::encode(&found.in_take)),
            (run.folders.unstacked(layer), ply::encode(&with_weights(&found.garment, &found.weights))),
        ],
        result: plain(&found.report)?,
        warnings,
        failures: nothing.into_iter().map(left_out).collect(),
        ..Product::default()
    })
}

/// More unsure vertices than this are worth a warning.
const UNSURE_SHARE: f32 = 0.15;
