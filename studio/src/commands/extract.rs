//! `toile extract`: the garments out of the dressed scans.

use std::path::PathBuf;
use toile_pipeline::{Goal, Options};

use crate::{
    StudioError,
    commands::{
        cloth::ClothOptions,
        reach::{must_exist, reach},
    },
    outcome::Answer,
    session::Session,
};

const AFTER: &str = "\
Runs the missing steps before it: fusing, the body, the poses.

Examples:
  toile extract anna
  toile extract anna trousers      only up to this layer
  toile extract anna --generic     the same vertices and triangles for every subject
  toile extract anna --part body   tight garments press the body in";

/// Extract the garments from the dressed scans and stack them
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Extract {
    /// The subject
    subject: PathBuf,
    /// Stop after this layer, such as `trousers` or `01-trousers`
    layer: Option<String>,
    #[command(flatten)]
    cloth: ClothOptions,
    /// Settings of the stages; they win over those of SUBJECT/toile.toml
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
}

impl Extract {
    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] where a stage has no answer or files cannot be read or written.
    pub fn run(&self, session: &Session) -> Result<Answer, StudioError> {
        must_exist(&self.subject)?;
        let options = Options {
            last_layer: self.layer.clone(),
            generic: self.cloth.generic(),
            part: self.cloth.part(),
            settings: self.settings.clone(),
            ..Options::default()
        };
        reach(&self.subject, Goal::Garments, &options, session)
    }
}
