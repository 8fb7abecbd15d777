//! Stage `fuse`: a take → its scan.
//!
//! Reads a recording (or an importable folder). Writes `scan.ply` and `trajectory.tum`.

use std::path::{Path, PathBuf};

use toile_fusion::{FusionSettings, fuse};
use toile_geometry::ply;

use crate::{
    PipelineError, Run,
    opened::Opened,
    stage::{Product, Record, Stage, plain},
};

/// Raised whenever the same recording and settings give another scan.
const VERSION: u32 = 3;
/// Expected seconds for a turn of 100 frames.
pub const COST: f64 = 9.0;

/// Fuses one take of a subject, unless that is up to date.
///
/// # Errors
/// [`PipelineError`] where the take cannot be read, nobody is in it, or files cannot be written.
pub fn run(run: &Run, layer: &str, settings: &FusionSettings) -> Result<Record, PipelineError> {
    fuse_recording(run, &run.take(layer), &run.folders.layer(layer), layer, settings)
}

/// Fuses any recording or importable folder into `folder`.
///
/// # Errors
/// As [`run`].
pub fn fuse_recording(
    run: &Run,
    recording: &Path,
    folder: &Path,
    name: &str,
    settings: &FusionSettings,
) -> Result<Record, PipelineError> {
    let outputs = vec![folder.join("scan.ply"), folder.join("trajectory.tum")];
    let stage = Stage {
        name: "fuse",
        version: VERSION,
        cost: COST,
        root: &run.folders.root,
        folder: folder.to_path_buf(),
        inputs: files_of(recording)?,
        settings: plain(settings)?,
        outputs: outputs.clone(),
        outputs_vary: false,
    };
    stage.run(&run.label(name, "fuse"), run.observer, |progress| {
        let opened = Opened::new(recording, None)?;
        let (mut source, lost, dropped) = (opened.source, opened.lost, opened.dropped);
        let scan = fuse(source.as_mut(), settings, progress).map_err(|e| PipelineError::stage(recording, e))?;
        let mut warnings: Vec<String> = scan.report.warnings.iter().map(|w| format!("{name}: {w}")).collect();
        if dropped > 0 {
            warnings.push(format!("{name}: {dropped} frames never arrived while recording"));
        }
        let files = vec![
            (outputs[0].clone(), ply::encode(&scan.mesh)),
            (outputs[1].clone(), scan.trajectory_tum().into_bytes()),
        ];
        let (result, timings) = (plain(&scan.report)?, plain(&scan.timings)?);
        Ok(Product { files, warnings, lost, result, timings, ..Product::default() })
    })
}

/// The files that make a recording: itself, or everything in its folder, in the order of their names.
fn files_of(recording: &Path) -> Result<Vec<PathBuf>, PipelineError> {
    if !recording.is_dir() {
        return Ok(vec![recording.to_path_buf()]);
    }
    let entries = std::fs::read_dir(recording).map_err(|e| PipelineError::io(recording, e))?;
    let mut paths: Vec<PathBuf> = entries.flatten().map(|e| e.path()).collect();
    paths.sort();
    let nested: Vec<Vec<PathBuf>> = paths.iter().map(|p| files_of(p)).collect::<Result<_, _>>()?;
    Ok(nested.into_iter().flatten().collect())
}
