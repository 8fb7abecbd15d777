//! `toile sculpt`: the body as implicit primitives.

use std::path::PathBuf;

use serde_json::json;
use toile_capture::printable_path;
use toile_pipeline::{Remarks, Sculpted, sculpt};

use crate::{StudioError, commands::reach::must_exist, outcome::Answer, session::Session};

const AFTER: &str = "\
Writes SUBJECT/build/implicit/: body.toml (ellipsoids on the skeleton, some 25 kB, to be read and edited), body.ply (their
surface in the pose of the body's scan) and avatar-implicit.glb (the surface with skeleton, weights and the walk). The
body is fitted first where it is missing. docs/implicit.md describes the file.

Example:
  toile sculpt anna";

/// Fit implicit primitives to the body: a compact body that can be edited
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Sculpt {
    /// The subject
    subject: PathBuf,
    /// Settings of the stages; they win over those of SUBJECT/toile.toml
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
}

impl Sculpt {
    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] where a stage has no answer or files cannot be read or written.
    pub fn run(&self, session: &Session) -> Result<Answer, StudioError> {
        must_exist(&self.subject)?;
        let Sculpted { files, fitted, bytes, remarks } =
            sculpt(&self.subject, self.settings.as_deref(), session.progress.as_ref())?;
        let paths = files.iter().map(|path| printable_path(path).clone());
        let text = format!(
            "{}\n{} primitives in {:.1} kB; their surface is {:.2} mm from the body on average, 95 % of it within {:.2} mm\n",
            paths.clone().collect::<Vec<_>>().join("\n"),
            fitted.primitives,
            bytes as f64 / 1e3,
            1e3 * fitted.mean,
            1e3 * fitted.p95,
        );
        let results = json!({
            "files": paths.collect::<Vec<_>>(),
            "primitives": fitted.primitives,
            "bytes": bytes,
            "mean_m": fitted.mean,
            "p95_m": fitted.p95,
        });
        let Remarks { warnings, lost, failures } = remarks;
        Ok(Answer { text, results, warnings, lost, failures })
    }
}
