//! What a batch tells while it runs.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

/// What a batch tells while it runs; a line of JSON each with `--json`.
#[derive(Debug, Clone, Serialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Event<'a> {
    /// A subject's process begins.
    Begins {
        /// The subject's path in the archive.
        subject: &'a Path,
        /// 1, or 2 the second time.
        attempt: u32,
        /// Subjects that run now, this one included.
        running: usize,
    },
    /// A subject is finished, one way or the other.
    Ends {
        /// How.
        #[serde(flatten)]
        ended: &'a Ended,
        /// Subjects that are finished now.
        done: usize,
        /// Subjects in all.
        of: usize,
        /// Seconds that it was expected to take.
        expected_seconds: f64,
        /// Expected seconds until the end of the batch.
        seconds_left: f64,
    },
    /// A subject failed or was killed, and will be tried once more.
    Again {
        /// The subject's path in the archive.
        subject: &'a Path,
        /// What happened.
        why: &'a str,
    },
    /// Another program writes the subject; it comes later.
    Busy {
        /// The subject's path in the archive.
        subject: &'a Path,
    },
}

/// How a subject ended, in a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fate {
    /// All is well.
    Done,
    /// Done, but recorded data was lost.
    Lost,
    /// Done, but for a part: a take in which nothing new is worn.
    FailedInPart,
    /// There is no result.
    Failed,
    /// Another program was writing it for too long.
    Busy,
    /// Another batch had done it.
    Elsewhere,
}

/// How a subject ended.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Ended {
    /// Its path in the archive.
    pub subject: PathBuf,
    /// How, in a word.
    pub outcome: Fate,
    /// What happened, where it failed.
    pub why: Option<String>,
    /// How often it was tried.
    pub attempts: u32,
    /// Seconds of the last attempt.
    pub seconds: f64,
    /// Processor seconds of all attempts.
    pub cpu_seconds: f64,
    /// The most resident memory of the last attempt, bytes.
    pub peak_memory_bytes: u64,
    /// Warnings of its steps.
    pub warnings: Vec<String>,
    /// Recorded data that was lost.
    pub lost: Vec<String>,
    /// Failures after which the run went on.
    pub failures: Vec<String>,
}

impl Ended {
    /// True where it has results of its own run.
    pub fn has_result(&self) -> bool {
        matches!(self.outcome, Fate::Done | Fate::Lost | Fate::FailedInPart)
    }

    /// The word as it is printed.
    pub fn word(&self) -> &'static str {
        match self.outcome {
            Fate::Done => "done",
            Fate::Lost => "done, data lost",
            Fate::FailedInPart => "failed in part",
            Fate::Failed => "failed",
            Fate::Busy => "busy",
            Fate::Elsewhere => "done elsewhere",
        }
    }

    /// A list of sentences in the answer of a subject's process.
    pub(crate) fn sentences(answer: &Value, key: &str) -> Vec<String> {
        let list = answer["results"][0][key].as_array().into_iter().flatten();
        list.filter_map(|sentence| sentence.as_str().map(String::from)).collect()
    }
}
