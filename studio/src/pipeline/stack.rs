//! Stage `stack`: every garment outside the body and all garments below it.
//!
//! Reads `body/body.ply` and each `unstacked.ply`. Writes each `garment.ply`, in scan 0's pose and frame.

use toile_garments::{LayerReport, StackSettings, stack};
use toile_geometry::{Mesh, ply};

use crate::{
    StudioError,
    pipeline::{Run, skin_attributes::take_weights},
    stage::{Product, Record, Stage, plain},
};

/// Raised whenever the same inputs and settings give other garments.
const VERSION: u32 = 2;
/// Expected seconds for each garment.
pub const COST: f64 = 1.5;

/// Stacks all garments, unless they are up to date.
///
/// # Errors
/// [`StudioError`] where a mesh is broken, or files cannot be read or written.
pub fn run(run: &Run) -> Result<Record, StudioError> {
    let folders = &run.folders;
    let garments: Vec<&str> = run.garments().collect();
    let settings = StackSettings::default();
    let inputs = std::iter::once(folders.body_mesh()).chain(garments.iter().map(|l| folders.unstacked(l))).collect();
    let stage = Stage {
        name: "stack",
        version: VERSION,
        cost: COST * garments.len() as f64,
        root: &folders.root,
        folder: folders.layers(),
        inputs,
        settings: plain(&settings)?,
        outputs: garments.iter().map(|l| folders.garment(l)).collect(),
        outputs_vary: false,
    };
    stage.run(&run.label("layers", "stack"), run.progress, |progress| {
        let body = run.read_mesh(&folders.body_mesh())?;
        let mut layers: Vec<Mesh> = garments.iter().map(|l| garment(run, l)).collect::<Result<_, _>>()?;
        let report =
            stack(&body, &mut layers, &settings, progress).map_err(|e| StudioError::stage(&folders.root, e))?;
        let files = garments.iter().zip(&layers).map(|(l, mesh)| (folders.garment(l), ply::encode(mesh))).collect();
        let warnings = garments.iter().zip(&report.layers).filter_map(|(l, r)| warning(l, r)).collect();
        Ok(Product { files, result: plain(&report)?, warnings, ..Product::default() })
    })
}

fn garment(run: &Run, layer: &str) -> Result<Mesh, StudioError> {
    let mut mesh = run.read_mesh(&run.folders.unstacked(layer))?;
    take_weights(&mut mesh);
    Ok(mesh)
}

fn warning(layer: &str, report: &LayerReport) -> Option<String> {
    let pairs = report.crossing_pairs;
    (pairs > 0).then(|| format!("{layer}: {pairs} pairs of triangles still cut through a layer below"))
}
