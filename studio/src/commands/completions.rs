//! `toile completions`: completions for a shell.

use clap::CommandFactory;
use serde_json::json;

use crate::{StudioError, cli::Cli, outcome::Answer};

const AFTER: &str = "\
Examples:
  toile completions bash > ~/.local/share/bash-completion/completions/toile
  toile completions fish > ~/.config/fish/completions/toile.fish";

/// Print completions for a shell.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Completions {
    /// Which shell
    shell: clap_complete::Shell,
}

impl Completions {
    /// Runs the command.
    ///
    /// # Errors
    /// None.
    pub fn run(&self) -> Result<Answer, StudioError> {
        let mut bytes = Vec::new();
        clap_complete::generate(self.shell, &mut Cli::command(), "toile", &mut bytes);
        let text = String::from_utf8_lossy(&bytes).into_owned();
        Ok(Answer { results: json!({ "script": text }), text, ..Answer::default() })
    }
}
