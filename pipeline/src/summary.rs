//! What a run made, and what is to be said of it.

use serde::Serialize;

use crate::{Run, options::Goal, stage::Record};

/// What a run made and what is to be said of it.
#[derive(Debug, Default, Serialize)]
pub struct Summary {
    /// The layers, body first.
    pub layers: Vec<String>,
    /// Measurements by name: metres, cubic metres.
    pub measurements: serde_json::Value,
    /// The files that were asked for.
    pub files: Vec<String>,
    /// What each stage decided, by layer and stage.
    pub stages: Vec<(String, Record)>,
    /// What to worry about.
    pub warnings: Vec<String>,
    /// Recorded data that was lost.
    pub lost: Vec<String>,
    /// What failed although the run went on.
    pub failures: Vec<String>,
}

impl Summary {
    /// Takes in what a stage said.
    pub(crate) fn add(&mut self, layer: &str, stage: &str, record: Record) {
        self.warnings.extend(record.warnings.iter().cloned());
        self.lost.extend(record.lost.iter().cloned());
        self.failures.extend(record.failures.iter().cloned());
        self.stages.push((format!("{layer}/{stage}"), record));
    }

    /// Names the layers, the measurements and the files of `goal`.
    pub(crate) fn finish(&mut self, run: &Run, goal: Goal, measurements: serde_json::Value) {
        self.layers = std::iter::once("body".to_string()).chain(run.garments().map(String::from)).collect();
        let folders = &run.folders;
        let files = match goal {
            Goal::Scans => run.layers.iter().map(|l| folders.scan(l)).collect(),
            Goal::Body => vec![folders.body_mesh(), folders.body_json()],
            Goal::Garments => run.garments().map(|l| folders.garment(l)).collect(),
            Goal::Avatar => vec![folders.glb(), folders.vrm()],
            Goal::Report => vec![folders.glb(), folders.vrm(), folders.report()],
        };
        self.files = files.iter().map(|p| p.display().to_string()).collect();
        self.measurements = measurements;
    }
}
