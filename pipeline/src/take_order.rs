//! Whether the takes are in the order in which garments are put on.

use std::path::Path;

use toile_capture::printable_path;
use toile_garments::{Bulk, are_taken_off};

use crate::{PipelineError, Run, meshes::read_mesh};

/// Refuses a subject whose first take is known not to be the body.
///
/// # Errors
/// [`PipelineError`] with the command that puts the takes in order.
pub fn check_first(run: &Run) -> Result<(), PipelineError> {
    match run.wrong_order() {
        Some(reason) => Err(PipelineError::refused(&run.folders.subject_toml(), reason)),
        None => Ok(()),
    }
}

/// A sentence where the scans show that garments were taken off from take to take, with the command that mends it.
///
/// # Errors
/// [`PipelineError`] where a scan cannot be read.
pub fn taken_off(run: &Run) -> Result<Option<String>, PipelineError> {
    if run.layers.len() < 2 {
        return Ok(None);
    }
    let bulk = |layer: &String| read_mesh(&run.folders.scan(layer)).map(|scan| Bulk::of(&scan));
    let takes = run.layers.iter().map(bulk).collect::<Result<Vec<_>, _>>()?;
    Ok(are_taken_off(&takes).then(|| sentence(&run.folders.root, &run.layers, &takes)))
}

fn sentence(root: &Path, layers: &[String], takes: &[Bulk]) -> String {
    let litres: Vec<String> = takes.iter().map(|take| format!("{:.1}", 1e3 * take.volume_m3)).collect();
    let names: Vec<&str> = layers.iter().map(|layer| layer.split_once('-').map_or(layer.as_str(), |l| l.1)).collect();
    let (root, litres, names) = (printable_path(root), litres.join(", "), names.join(","));
    format!(
        "{root}: its scans get smaller from take to take ({litres} litres), so garments seem to have been taken off one by \
         one; `toile reorder {root} --reverse --names {names}` puts the takes in the order in which garments are put on \
         (--names: what the layers are called from the body outward)"
    )
}
