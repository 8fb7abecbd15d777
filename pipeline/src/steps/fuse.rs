//! Step `fuse`: a take → its scan.
//!
//! Reads a recording (or an importable folder). Writes `scan.ply` and `trajectory.tum`.

use std::path::{Path, PathBuf};

use serde_json::Value;
use toile_fusion::{FusionReport, FusionSettings, fuse};
use toile_geometry::ply;

use crate::{
    PipelineError, Run, json,
    opened::Opened,
    step::{Product, Remarks, Step},
};

/// Fusing one recording.
pub struct Fuse<'a> {
    /// The run.
    pub run: &'a Run<'a>,
    /// A recording, or an importable folder.
    pub recording: PathBuf,
    /// Folder of the files.
    pub folder: PathBuf,
    /// The name of the take.
    pub name: String,
    /// How it is fused.
    pub settings: &'a FusionSettings,
}

impl<'a> Fuse<'a> {
    /// Fusing a take of the run's subject.
    pub fn of_layer(run: &'a Run<'a>, layer: &str) -> Self {
        let (recording, folder) = (run.folders.take(layer), run.folders.layer(layer));
        Self { run, recording, folder, name: layer.to_string(), settings: &run.settings.fusion }
    }
}

impl Step for Fuse<'_> {
    type Report = FusionReport;
    const NAME: &'static str = "fuse";
    const VERSION: u32 = 4;
    // A turn of 100 frames.
    const SECONDS: f64 = 9.0;

    fn label(&self) -> String {
        self.run.label(&self.name, "fuse")
    }

    fn folder(&self) -> PathBuf {
        self.folder.clone()
    }

    fn inputs(&self) -> Result<Vec<PathBuf>, PipelineError> {
        files_of(&self.recording)
    }

    fn settings(&self) -> Result<Value, PipelineError> {
        json::plain(self.settings)
    }

    fn outputs(&self) -> Vec<PathBuf> {
        vec![self.folder.join("scan.ply"), self.folder.join("trajectory.tum")]
    }

    fn work(&self, progress: &(dyn Fn(f32) + Sync)) -> Result<Product<FusionReport>, PipelineError> {
        let Opened { mut source, lost, dropped } = Opened::new(&self.recording, None)?;
        let wrong = |e| PipelineError::stage(&self.recording, e);
        let scan = fuse(source.as_mut(), self.settings, progress).map_err(wrong)?;
        let mut warnings: Vec<String> = scan.report.warnings.iter().map(|w| format!("{}: {w}", self.name)).collect();
        if dropped > 0 {
            warnings.push(format!("{}: {dropped} frames never arrived while recording", self.name));
        }
        let contents = [ply::encode(&scan.mesh), scan.trajectory_tum().into_bytes()];
        Ok(Product {
            files: self.outputs().into_iter().zip(contents).collect(),
            timings: json::plain(&scan.timings)?,
            report: scan.report,
            remarks: Remarks { warnings, lost, ..Remarks::default() },
        })
    }
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
