//! How a command ended, and how that is reported to people, machines and the shell.

use serde_json::{Value, json};
use toile_capture::printable_path;

use crate::StudioError;

/// The answer of a command.
#[derive(Debug, Default)]
pub struct Answer {
    /// For people, on standard output; may have several lines.
    pub text: String,
    /// For machines.
    pub results: Value,
    /// Warnings, a sentence each.
    pub warnings: Vec<String>,
    /// Recorded data that was lost, a sentence each.
    pub lost: Vec<String>,
    /// Failures after which the command went on, a sentence each.
    pub failures: Vec<String>,
}

/// The four ways in which a command ends; the numbers are the program's exit codes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Outcome {
    /// All is well.
    Done = 0,
    /// There is no result, or only a part of it.
    Failed = 1,
    /// The command line is wrong.
    Usage = 2,
    /// There is a result, but recorded data was lost.
    Lost = 3,
}

impl Outcome {
    /// How `answer` counts.
    pub fn of(answer: &Result<Answer, StudioError>) -> Self {
        match answer {
            Err(error) if error.kind() == "usage" => Self::Usage,
            Err(_) => Self::Failed,
            Ok(answer) if !answer.failures.is_empty() => Self::Failed,
            Ok(answer) if !answer.lost.is_empty() => Self::Lost,
            Ok(_) => Self::Done,
        }
    }

    /// Its name in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Done => "done",
            Self::Failed => "failed",
            Self::Usage => "usage",
            Self::Lost => "lost",
        }
    }
}

/// The document that `--json` prints.
pub fn document(command: &str, answer: &Result<Answer, StudioError>) -> Value {
    let mut document = json!({ "command": command, "outcome": Outcome::of(answer).name() });
    let more = match answer {
        Ok(a) => json!({ "results": a.results, "warnings": a.warnings, "lost": a.lost, "failures": a.failures }),
        Err(error) => json!({ "error": error_document(error) }),
    };
    if let (Value::Object(document), Value::Object(more)) = (&mut document, more) {
        document.extend(more);
    }
    document
}

/// The JSON of an error: its kind and message, and the file and field that it concerns where they are known.
pub fn error_document(error: &StudioError) -> Value {
    let mut reported = json!({ "kind": error.kind(), "message": error.to_string() });
    if let Some(file) = error.file() {
        reported["file"] = printable_path(file).into();
    }
    if let Some(field) = error.field() {
        reported["field"] = field.into();
    }
    reported
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_warning_is_not_a_loss_and_a_failure_outweighs_a_loss() {
        let of = |answer| Outcome::of(&Ok(answer));
        let some = || vec!["a sentence".to_string()];
        assert_eq!(of(Answer { warnings: some(), ..Answer::default() }), Outcome::Done);
        assert_eq!(of(Answer { lost: some(), ..Answer::default() }), Outcome::Lost);
        assert_eq!(of(Answer { lost: some(), failures: some(), ..Answer::default() }), Outcome::Failed);
        assert_eq!(Outcome::of(&Err(StudioError::Usage("no".into()))), Outcome::Usage);
    }
}
