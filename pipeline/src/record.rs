//! `report.json`: what the steps that worked in a folder decided.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize, de::DeserializeOwned};
use serde_json::Value;
use toile_capture::files::{atomic_write, is_there};

use crate::{PipelineError, hash, json};

/// The content of `report.json` for one step, with the typed report `R`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record<R> {
    /// Version of the step.
    pub version: u32,
    /// Hash of program, step, version, inputs and settings.
    pub hash: String,
    /// SHA-256 of every input by its path.
    pub inputs: BTreeMap<String, String>,
    /// The resolved settings.
    pub settings: Value,
    /// SHA-256 of every output by its path.
    pub outputs: BTreeMap<String, String>,
    /// The decisions.
    pub result: R,
    /// Warnings.
    pub warnings: Vec<String>,
    /// Recorded data that was lost.
    pub lost: Vec<String>,
    /// Failures after which the run went on.
    pub failures: Vec<String>,
}

/// A step's part of the file: its record, and a hash of that, so that a change by hand is noticed.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Sealed {
    #[serde(flatten)]
    record: Value,
    /// SHA-256 of the record; a record without one is of an earlier version.
    seal: Option<String>,
}

/// The file: every step that worked in the folder.
#[derive(Debug, Default, Serialize, Deserialize)]
struct ReportFile {
    program: String,
    stages: BTreeMap<String, Sealed>,
}

/// Where the records of a folder are.
pub fn report_path(folder: &Path) -> PathBuf {
    folder.join("report.json")
}

/// The record of the step called `step` in `folder`; `None` where it never worked there.
///
/// # Errors
/// [`PipelineError::Format`] that names file and field where the file is damaged, was changed since it was written, or
/// is of another version of the program.
pub fn read<R: DeserializeOwned>(folder: &Path, step: &str) -> Result<Option<Record<R>>, PipelineError> {
    let path = report_path(folder);
    let sealed = read_file(&path)?.stages.remove(step);
    let Some(Sealed { record, seal: Some(seal) }) = sealed else { return Ok(None) };
    if seal_of(&record) != seal {
        return Err(PipelineError::field(&path, &format!("stages.{step}"), "was changed since it was written"));
    }
    json::from_value(&path, &format!("stages.{step}"), record).map(Some)
}

/// Which steps worked in `folder` and left a record that was not changed since.
pub fn steps_in(folder: &Path) -> Vec<String> {
    let stages = read_file(&report_path(folder)).unwrap_or_default().stages;
    let is_whole = |stage: &Sealed| stage.seal.as_ref().is_some_and(|seal| seal_of(&stage.record) == *seal);
    stages.into_iter().filter(|(_, stage)| is_whole(stage)).map(|(step, _)| step).collect()
}

/// The files that the steps in `folder` read and wrote, by step; paths as in the records. A file that cannot be read gives none.
pub(crate) fn files_in(folder: &Path) -> BTreeMap<String, BTreeSet<String>> {
    let names = |record: &Value, key: &str| -> Vec<String> {
        record.get(key).and_then(Value::as_object).map_or_else(Vec::new, |map| map.keys().cloned().collect())
    };
    let stages = read_file(&report_path(folder)).unwrap_or_default().stages;
    let files = |record: &Value| names(record, "inputs").into_iter().chain(names(record, "outputs")).collect();
    stages.into_iter().map(|(step, sealed)| (step, files(&sealed.record))).collect()
}

/// The records of all steps that worked in `folder`, by step, as far as they were not changed since.
pub fn all_in(folder: &Path) -> Vec<(String, Record<Value>)> {
    let stages = read_file(&report_path(folder)).unwrap_or_default().stages;
    let whole =
        stages.into_iter().filter(|(_, stage)| stage.seal.as_ref().is_some_and(|s| seal_of(&stage.record) == *s));
    whole.filter_map(|(step, stage)| Some((step, serde_json::from_value(stage.record).ok()?))).collect()
}

/// Puts the record of `step` into the file of `folder`, beside those of other steps.
///
/// # Errors
/// [`PipelineError`] where it cannot be written, or would not be read back as it is.
pub fn write<R: Serialize + DeserializeOwned>(
    folder: &Path,
    program: &str,
    step: &str,
    record: &Record<R>,
) -> Result<(), PipelineError> {
    let path = report_path(folder);
    let record = json::plain(record)?;
    json::from_value::<Record<R>>(&path, &format!("stages.{step}"), record.clone())?;
    // What cannot be read any more is built again by its own steps.
    let mut file = read_file(&path).unwrap_or_default();
    file.program = program.into();
    file.stages.insert(step.into(), Sealed { seal: Some(seal_of(&record)), record });
    Ok(atomic_write(&path, &json::pretty(&file)?)?)
}

fn read_file(path: &Path) -> Result<ReportFile, PipelineError> {
    if is_there(path) { json::read(path) } else { Ok(ReportFile::default()) }
}

fn seal_of(record: &Value) -> String {
    hash::bytes(record.to_string().as_bytes())
}
