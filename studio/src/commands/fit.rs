//! `toile fit`: the body of a subject, or of any scan.

use std::path::{Path, PathBuf};

use serde_json::json;
use toile_capture::printable_path;
use toile_character::BodyModel;
use toile_pipeline::{
    BodyEdits, Folders, Goal, Observer, Options, Run, Step, settings,
    steps::fit::{FILES, Fit as FitStep},
};

use crate::{
    StudioError,
    commands::{
        output::check_stage,
        reach::{must_exist, reach},
    },
    outcome::Answer,
    session::Session,
};

const AFTER: &str = "\
Examples:
  toile fit anna
  toile fit --scan somebody.ply --out somebody
  toile fit --scan in-coat.ply --out estimate --dressed

Landmarks set by hand, and subjects without an undressed take: docs/edits.md.";

/// Fit the body to the scan of the undressed person
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Fit {
    #[command(flatten)]
    person: Person,
}

/// Whose body: a subject's, or that of any scan.
#[derive(Debug, clap::Args)]
pub struct Person {
    /// The subject
    #[arg(required_unless_present = "scan", conflicts_with = "scan")]
    pub subject: Option<PathBuf>,
    /// Instead of a subject: any mesh of a standing person, scan or body (PLY or OBJ), metres, +Y up
    #[arg(long, value_name = "MESH", requires = "out")]
    pub scan: Option<PathBuf>,
    /// Folder of the result, with --scan
    #[arg(long, value_name = "DIR", requires = "scan")]
    pub out: Option<PathBuf>,
    /// The person in the scan is dressed: the body under the clothes is estimated
    #[arg(long, requires = "scan")]
    pub dressed: bool,
    /// Statements by hand: landmarks on the scan, shape components, joints: JSON, as in docs/edits.md
    #[arg(long, value_name = "FILE", requires = "scan", alias = "landmarks")]
    pub edits: Option<PathBuf>,
    /// Settings of the stages; they win over those of SUBJECT/toile.toml
    #[arg(long, value_name = "FILE")]
    pub settings: Option<PathBuf>,
}

impl Person {
    /// Fits the body, or reaches the subject's, and names the folder where its files are.
    ///
    /// # Errors
    /// [`StudioError`] where there is no person in the scan, or files cannot be read or written.
    pub fn fitted(&self, session: &Session) -> Result<(Answer, PathBuf), StudioError> {
        match (&self.subject, &self.scan, &self.out) {
            (Some(subject), ..) => {
                must_exist(subject)?;
                let answer = reach(
                    subject,
                    Goal::Body,
                    &Options { settings: self.settings.clone(), ..Options::default() },
                    session,
                )?;
                Ok((answer, Folders::new(subject).body()))
            }
            (None, Some(scan), Some(out)) => {
                let mut edits = self.edits.as_deref().map(BodyEdits::read).transpose()?.unwrap_or_default();
                edits.dressed |= self.dressed;
                Ok((fit_scan(scan, out, &edits, self.settings.as_deref(), session)?, out.clone()))
            }
            _ => Err(StudioError::Usage("give a subject, or --scan MESH with --out DIR".into())),
        }
    }
}

impl Fit {
    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] where there is no person in the scan, or files cannot be read or written.
    pub fn run(&self, session: &Session) -> Result<Answer, StudioError> {
        Ok(self.person.fitted(session)?.0)
    }
}

/// Fits a body to any scan and writes its files into `out`.
///
/// # Errors
/// As [`Fit::run`].
fn fit_scan(
    scan: &Path,
    out: &Path,
    edits: &BodyEdits,
    settings_file: Option<&Path>,
    session: &Session,
) -> Result<Answer, StudioError> {
    must_exist(scan)?;
    check_stage(out, FitStep::NAME, &[&FILES[..], &["pose.json"]].concat(), scan)?;
    let name = scan.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let run = Run::single(
        scan.parent().unwrap_or(Path::new(".")),
        &name,
        settings::read(None, settings_file)?,
        session.progress.as_ref(),
    );
    session.progress.plan(FitStep::SECONDS);
    let model = BodyModel::load_default()?;
    let record = run.step(&FitStep::of_scan(&run, &model, scan, out, edits))?;
    let files: Vec<String> = FILES.iter().chain(&["pose.json"]).map(|f| printable_path(&out.join(f))).collect();
    Ok(Answer {
        text: files.iter().map(|f| format!("{f}\n")).collect(),
        results: json!({ "files": files, "fit": record.result }),
        warnings: record.warnings,
        ..Answer::default()
    })
}
