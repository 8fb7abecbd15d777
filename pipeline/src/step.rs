//! A stage on disk.

use std::path::PathBuf;

use serde::{Serialize, de::DeserializeOwned};
use serde_json::Value;

use crate::PipelineError;

/// One stage of one run: which files it reads and writes, what decides its result, and the work itself.
///
/// A step is a plain value that knows its run and its take. [`crate::run_step`] looks whether its record still holds, and
/// calls [`Step::work`] where it does not.
pub trait Step {
    /// The decisions of the step: residuals, counts, verdicts. Later steps and the page read it. It must be the same for
    /// any number of threads.
    type Report: Serialize + DeserializeOwned;

    /// Name of the step: its key in `report.json`.
    const NAME: &'static str;
    /// Raised whenever the same inputs and settings give another result.
    const VERSION: u32;
    /// Expected seconds of one run, for the time that is left.
    const SECONDS: f64;
    /// True where the outputs contain times and so differ from run to run: the record then has no hash of them, but `timings.json`.
    const OUTPUTS_VARY: bool = false;

    /// The name of the step while it runs.
    fn label(&self) -> String;

    /// Folder of the step's `report.json` and `timings.json`.
    fn folder(&self) -> PathBuf;

    /// Files that decide the result.
    ///
    /// # Errors
    /// [`PipelineError`] where a folder that holds them cannot be listed.
    fn inputs(&self) -> Result<Vec<PathBuf>, PipelineError>;

    /// Everything else that decides the result, resolved.
    ///
    /// # Errors
    /// [`PipelineError`] where a setting cannot be written as JSON.
    fn settings(&self) -> Result<Value, PipelineError>;

    /// Files that the step writes.
    fn outputs(&self) -> Vec<PathBuf>;

    /// Expected seconds of this step.
    fn seconds(&self) -> f64 {
        Self::SECONDS
    }

    /// Does the work; `progress` hears the fraction done, from any thread.
    ///
    /// # Errors
    /// [`PipelineError`] where the stage has no answer or a file cannot be read.
    fn work(&self, progress: &(dyn Fn(f32) + Sync)) -> Result<Product<Self::Report>, PipelineError>;
}

/// The results of a step.
pub struct Product<R> {
    /// The files, one for each of the step's outputs.
    pub files: Vec<(PathBuf, Vec<u8>)>,
    /// The decisions.
    pub report: R,
    /// Remarks about it.
    pub remarks: Remarks,
    /// Milliseconds by step and the like: a JSON object, or null.
    pub timings: Value,
}

/// Remarks about a result, a sentence each.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Remarks {
    /// Warnings.
    pub warnings: Vec<String>,
    /// Recorded data that was lost.
    pub lost: Vec<String>,
    /// Failures after which the run goes on.
    pub failures: Vec<String>,
}

impl<R> Product<R> {
    /// Files and a report, with warnings.
    pub fn new(files: Vec<(PathBuf, Vec<u8>)>, report: R, warnings: Vec<String>) -> Self {
        Self { files, report, remarks: Remarks { warnings, ..Remarks::default() }, timings: Value::Null }
    }
}
