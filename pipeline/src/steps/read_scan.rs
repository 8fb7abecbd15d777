//! Step `read`: a take that is a finished scan → its scan in metres, upright, clean.
//!
//! Reads the files in `takes/NN-name.scan/`. Writes `scan.ply`. There is no trajectory: nobody knows where cameras stood.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use toile_capture::ScanTake;
use toile_geometry::ply;
use toile_scans::{CleanSettings, Cleaned, Unit, Up, clean};

use crate::{
    PipelineError, Run,
    scan_survey::ScanSurvey,
    step::{Product, Step},
};

/// Reading one finished scan.
pub struct ReadScan<'a> {
    run: &'a Run<'a>,
    /// The take.
    take: PathBuf,
    /// The name of the take.
    name: String,
}

/// The decisions of reading a finished scan.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ScanReport {
    /// The mesh file.
    pub file: String,
    /// The unit of its lengths.
    pub unit: Unit,
    /// True where somebody said it.
    pub unit_said: bool,
    /// The axis of the file that points up.
    pub up: Up,
    /// True where somebody said it.
    pub up_said: bool,
    /// What was done to the surface.
    pub cleaned: Cleaned,
}

impl<'a> ReadScan<'a> {
    /// Reading a take of the run's subject; `None` where it is a recording.
    pub fn of_layer(run: &'a Run<'a>, layer: &str) -> Option<Self> {
        let take = run.folders.scan_take(layer)?;
        Some(Self { run, take, name: layer.to_string() })
    }
}

impl Step for ReadScan<'_> {
    type Report = ScanReport;
    const NAME: &'static str = "read";
    const VERSION: u32 = 1;
    const SECONDS: f64 = 4.0;

    fn label(&self) -> String {
        self.run.label(&self.name, "read the scan")
    }

    fn folder(&self) -> PathBuf {
        self.run.folders.layer(&self.name)
    }

    fn inputs(&self) -> Result<Vec<PathBuf>, PipelineError> {
        Ok(ScanTake::open(&self.take)?.files())
    }

    fn settings(&self) -> Result<Value, PipelineError> {
        let fusion = &self.run.settings.fusion;
        Ok(json!({ "fill_holes": fusion.fill_holes, "target_triangles": fusion.target_triangles }))
    }

    fn outputs(&self) -> Vec<PathBuf> {
        vec![self.run.folders.scan(&self.name)]
    }

    fn work(&self, progress: &(dyn Fn(f32) + Sync)) -> Result<Product<ScanReport>, PipelineError> {
        let take = ScanTake::open(&self.take)?;
        let path = take.mesh_path();
        let ScanSurvey { surface, unit, up, sentences } = ScanSurvey::new(&path, take.unit, take.up)?;
        progress(0.5);
        let fusion = &self.run.settings.fusion;
        let settings = CleanSettings {
            unit: unit.metres(),
            upright: up.upright(),
            fill_holes: fusion.fill_holes,
            target_triangles: fusion.target_triangles,
        };
        let (scan, cleaned) = clean(&surface, &settings).map_err(|reason| PipelineError::format(&path, reason))?;
        let warnings = sentences.into_iter().chain(said_of(&cleaned));
        let warnings = warnings.map(|sentence| format!("{}: {sentence}", self.name)).collect();
        let file = Path::new(path.file_name().unwrap_or_default()).to_string_lossy().into_owned();
        let report = ScanReport { file, unit, unit_said: take.unit.is_some(), up, up_said: take.up.is_some(), cleaned };
        Ok(Product::new(vec![(self.run.folders.scan(&self.name), ply::encode(&scan))], report, warnings))
    }
}

/// What an operator should look at of what was done to a surface.
fn said_of(cleaned: &Cleaned) -> Vec<String> {
    let mut said = Vec::new();
    if !cleaned.has_colors {
        said.push("the scan has no colours; where a garment ends is found from its shape alone".into());
    }
    if let Some(height) = cleaned.ground_m {
        said.push(format!(
            "the ground under the person, {:.0} mm over the lowest point of the file, was cut away",
            1e3 * height
        ));
    }
    if cleaned.not_manifold * 100 > cleaned.triangles_raw {
        let share = 100.0 * cleaned.not_manifold as f64 / cleaned.triangles_raw.max(1) as f64;
        said.push(format!("{share:.0} % of the triangles meet at edges that more than two share, and were left out"));
    }
    said
}
