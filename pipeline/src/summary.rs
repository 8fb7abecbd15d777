//! The results of a run, and remarks about them.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::{Map, Value};
use toile_fitting::{FitReport, PartShown};
use toile_fusion::FusionReport;
use toile_garments::ExtractionReport;
use toile_texture::TextureReport;

use crate::{
    PipelineError, Record,
    body_file::BodyFile,
    json,
    step::Remarks,
    steps::{export::Exported, pose::PoseReport, read_scan::ScanReport, stack::Stacked},
};

/// The results of a run, and remarks about them.
#[derive(Debug, Default)]
pub struct Summary {
    /// The layers, body first.
    pub layers: Vec<String>,
    /// Measurements of the body, where there is one.
    pub measurements: Option<Measured>,
    /// The files that were asked for.
    pub files: Vec<std::path::PathBuf>,
    /// The decisions of the steps.
    pub decided: Decided,
    /// Remarks about it.
    pub remarks: Remarks,
    /// Actions of the run that were not asked for, a sentence each.
    pub notes: Vec<String>,
}

/// Measurements of the body, as far as the scan shows it.
#[derive(Debug, Clone, Serialize)]
pub struct Measured {
    /// Standing straight, metres; `None` where the scan shows a part of a person, without the floor.
    pub stature_m: Option<f64>,
    /// Girths by name, metres.
    pub girths_m: BTreeMap<String, f64>,
    /// Cubic metres; `None` where the scan shows a part of a person.
    pub volume_m3: Option<f64>,
}

impl Measured {
    /// Those of `body` that were measured; of a part of a person, girths above the scan's lower end only.
    pub(crate) fn of(body: BodyFile, part: Option<&PartShown>) -> Self {
        let BodyFile { stature_m, mut girths_m, girths, volume_m3, .. } = body;
        let Some(part) = part else {
            return Self { stature_m: Some(stature_m), girths_m, volume_m3: Some(volume_m3) };
        };
        girths_m.retain(|name, _| girths.get(name).is_some_and(|girth| girth.height_m > part.below_m));
        Self { stature_m: None, girths_m, volume_m3: None }
    }
}

/// The decisions of each step, as far as the run went.
#[derive(Debug, Default)]
pub struct Decided {
    /// The takes, in their order.
    pub takes: Vec<TakeSummary>,
    /// The body.
    pub body: Option<FitReport>,
    /// All layers together.
    pub stack: Option<Stacked>,
    /// The avatar.
    pub avatar: Option<Exported>,
}

/// The decisions of the steps of one take.
#[derive(Debug)]
pub struct TakeSummary {
    /// Folder name of the layer.
    pub layer: String,
    /// How its recording was fused; `None` where the take is a finished scan.
    pub fuse: Option<FusionReport>,
    /// How a finished scan was read; `None` where the take is a recording.
    pub read: Option<ScanReport>,
    /// Its texture; `None` where the take has no colour pictures, or none was asked for.
    pub texture: Option<TextureReport>,
    /// The body in it, where the take is dressed.
    pub pose: Option<PoseReport>,
    /// The garment.
    pub cut: Option<ExtractionReport>,
}

impl TakeSummary {
    /// Of a take of which nothing is decided yet.
    pub(crate) fn of(layer: &str) -> Self {
        Self { layer: layer.to_string(), fuse: None, read: None, texture: None, pose: None, cut: None }
    }
}

impl Summary {
    /// Takes in what is to be said of a step, and gives what it decided.
    pub(crate) fn hear<R>(&mut self, record: Record<R>) -> R {
        self.remarks.warnings.extend(record.warnings);
        self.remarks.lost.extend(record.lost);
        self.remarks.failures.extend(record.failures);
        record.result
    }
}

impl Decided {
    /// The decisions by layer and step, such as `00-body/fuse`.
    ///
    /// # Errors
    /// [`PipelineError::Json`] where one cannot be written as JSON.
    pub fn by_step(&self) -> Result<Map<String, Value>, PipelineError> {
        let mut all = Map::new();
        for take in &self.takes {
            insert(&mut all, format!("{}/fuse", take.layer), take.fuse.as_ref())?;
            insert(&mut all, format!("{}/read", take.layer), take.read.as_ref())?;
            insert(&mut all, format!("{}/texture", take.layer), take.texture.as_ref())?;
            insert(&mut all, format!("{}/pose", take.layer), take.pose.as_ref())?;
            insert(&mut all, format!("{}/cut", take.layer), take.cut.as_ref())?;
        }
        insert(&mut all, "body/fit".into(), self.body.as_ref())?;
        insert(&mut all, "layers/stack".into(), self.stack.as_ref())?;
        insert(&mut all, "avatar/export".into(), self.avatar.as_ref())?;
        Ok(all)
    }
}

fn insert(all: &mut Map<String, Value>, key: String, report: Option<&impl Serialize>) -> Result<(), PipelineError> {
    if let Some(report) = report {
        all.insert(key, json::plain(report)?);
    }
    Ok(())
}
