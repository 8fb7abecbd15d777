//! `toile settings`: the settings of all stages, as a file.

use std::path::PathBuf;

use toile_pipeline::{json, settings};

use crate::{StudioError, outcome::Answer, session::Session};

const AFTER: &str = "\
Without --print only what differs from the defaults is shown.
A subject's own settings lie in SUBJECT/toile.toml. What --settings FILE of another command says wins over them, field by
field. Every step writes the settings that it worked with into its report.json.

Examples:
  toile settings --print > toile.toml
  toile settings anna
  toile settings anna --settings seed.toml --print";

/// Show the settings of all stages, with units, ranges and defaults
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Settings {
    /// The subject whose own settings count
    subject: Option<PathBuf>,
    /// A file that wins over them
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Show all settings, as a file that can be changed and given with --settings
    #[arg(long)]
    print: bool,
}

impl Settings {
    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] names the file, the field and the line that are wrong.
    pub fn run(&self, _session: &Session) -> Result<Answer, StudioError> {
        let resolved = settings::read(self.subject.as_deref(), self.settings.as_deref())?;
        let all = settings::print(&resolved)?;
        let text = if self.print { all } else { changed(&all, &settings::print(&settings::Settings::default())?) };
        Ok(Answer { text, results: json::plain(&resolved)?, ..Answer::default() })
    }
}

/// The lines of `all` that differ from the defaults, each below its table.
fn changed(all: &str, defaults: &str) -> String {
    let (mut text, mut table) = (String::new(), "");
    for (line, default) in all.lines().zip(defaults.lines()) {
        if line.starts_with('[') {
            table = line;
        }
        if line != default {
            text.push_str(&format!("{}{line}\n", if table.is_empty() { String::new() } else { format!("{table}\n") }));
            table = "";
        }
    }
    if text.is_empty() { "every setting has its default\n".into() } else { text }
}

#[cfg(test)]
mod tests {
    #[test]
    fn only_what_differs_is_shown_below_its_table() {
        let (all, defaults) = ("[a]\nx = 1\ny = 2\n[b]\nz = 3\n", "[a]\nx = 0\ny = 0\n[b]\nz = 3\n");
        assert_eq!(super::changed(all, defaults), "[a]\nx = 1\ny = 2\n");
        assert!(super::changed(all, all).contains("default"));
    }
}
