//! `toile inspect`: the contents of a recording, a folder or a subject, and whether it is healthy.

use std::path::PathBuf;

use serde_json::json;
use toile_capture::inspect;
use toile_pipeline::{Folders, WornGarment, listed_worn};

use crate::{StudioError, commands::reach::must_exist, outcome::Answer, session::Session};

const AFTER: &str = "\
Exits with 3 where recorded data was lost (a torn file, frames that cannot be read).

Examples:
  toile inspect anna
  toile inspect anna/takes/00-body.mcap --json";

/// Show the contents of a recording, a folder or a subject, and whether it is healthy
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Inspect {
    /// A recording, a folder that import reads, or a subject
    path: PathBuf,
}

impl Inspect {
    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] where nothing at all can be read.
    pub fn run(&self, _session: &Session) -> Result<Answer, StudioError> {
        must_exist(&self.path)?;
        let found = inspect(&self.path)?;
        let mut warnings = found.subject.as_ref().map_or_else(Vec::new, |subject| subject.remarks.clone());
        let mut lost = Vec::new();
        for take in &found.takes {
            let problems = take.problems.iter().map(|p| format!("{}: {p}", take.name));
            if take.data_lost() { lost.extend(problems) } else { warnings.extend(problems) }
        }
        let mut text = format!("{found}\n");
        let mut results = json!(found);
        if found.subject.is_some() {
            let worn = listed_worn(&Folders::new(&self.path))?;
            worn.iter().for_each(|w| text += &format!("worn without a scan: {}, from {}\n", w.label, w.file.source));
            let of =
                |w: &WornGarment| json!({ "layer": w.label, "source": w.file.source, "type": w.file.garment_type });
            results["worn"] = worn.iter().map(of).collect();
        }
        Ok(Answer { text, results, warnings, lost, ..Answer::default() })
    }
}
