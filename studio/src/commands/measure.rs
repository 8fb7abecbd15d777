//! `toile measure`: the measurements of a subject, or of any scan or body.

use std::path::Path;

use serde_json::json;
use toile_capture::printable_path;
use toile_fitting::MeasureTable;
use toile_pipeline::json::read;

use crate::{StudioError, commands::fit::Person, outcome::Answer, session::Session};

const AFTER: &str = "\
Girths as a taut tape lies, heights above the soles, standing straight. Fits the body first where it has not been fitted.
The ± holds the true value in 95 of 100 cases; (?) marks a girth that does not
go with the others as it does among people, and a value that was seen too little to be measured.
measurements.csv has a line for each measurement: name, kind, value, unit, height of the tape's middle above the soles (cm),
definition, uncertainty (cm), share of the skin under the tape that was seen, and why it is doubted; measurements.json also has
where each tape lies, and the landmarks. docs/measurements.md explains them all.

Examples:
  toile measure anna
  toile measure --scan somebody.ply --out somebody      writes somebody/measurements.json and .csv";

/// Measure the body as a tailor does (ISO 8559-1)
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Measure {
    #[command(flatten)]
    person: Person,
}

impl Measure {
    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] where there is no person to measure, or files cannot be read or written.
    pub fn run(&self, session: &Session) -> Result<Answer, StudioError> {
        let (fitted, folder) = self.person.fitted(session)?;
        measured(fitted, &folder)
    }
}

/// The answer of a fit, with the table that it wrote into `folder`.
fn measured(fitted: Answer, folder: &Path) -> Result<Answer, StudioError> {
    let table: MeasureTable = read(&folder.join("measurements.json"))?;
    let width = table.measures.iter().map(|m| m.name.len()).max().unwrap_or(0);
    let mut text: String = table.measures.iter().map(|m| format!("{:width$}  {:>20}\n", m.name, m.text())).collect();
    text += &format!("{:width$}  {:6.1} l\n", "volume", table.volume_l);
    let files = ["measurements.json", "measurements.csv"].map(|f| printable_path(&folder.join(f)));
    text.extend(files.iter().map(|f| format!("{f}\n")));
    let values: serde_json::Map<_, _> = table.measures.iter().map(|m| (m.name.clone(), json!(m.value_m))).collect();
    let results = json!({ "measurements_m": values, "volume_l": table.volume_l, "files": files });
    Ok(Answer { text, results, ..fitted })
}
