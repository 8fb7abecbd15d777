//! `toile completions`: completions for a shell.

use serde_json::json;

use crate::outcome::Answer;

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
    /// Completions for the whole command line `of`.
    pub fn run(&self, mut of: clap::Command) -> Answer {
        let mut bytes = Vec::new();
        clap_complete::generate(self.shell, &mut of, "toile", &mut bytes);
        let text = String::from_utf8_lossy(&bytes).into_owned();
        Answer { results: json!({ "script": text }), text, ..Answer::default() }
    }
}
