//! A subject in the queue, and what is known of the memory that it needs.

use std::{path::PathBuf, time::Instant};

use super::{
    event::{Ended, Fate},
    worker::Outcome,
};

/// A subject whose process never ran, in an archive in which none ran yet, is taken to need so much, bytes: twice what four takes of
/// 100 frames were measured to need.
const ASSUMED: u64 = 512 << 20;
/// How much more than the last time a process may need: other threads, another allocator's mood. Measured peaks of one
/// subject lay within 6 % of each other.
const MARGIN: f64 = 1.1;

/// Memory to keep free for a subject, bytes: its own `peak`, or the largest that was `seen` in its archive.
pub(crate) fn memory_of(peak: Option<u64>, seen: Option<u64>) -> u64 {
    (MARGIN * peak.or(seen).unwrap_or(ASSUMED) as f64) as u64
}

/// A subject in the queue.
#[derive(Debug, Clone)]
pub(crate) struct Task {
    pub(crate) subject: PathBuf,
    /// Expected seconds.
    pub(crate) seconds: f64,
    /// The peak of its last run, bytes, where it is known.
    pub(crate) peak: Option<u64>,
    pub(crate) attempts: u32,
    pub(crate) cpu_seconds: f64,
    /// Since when another program has been writing it.
    pub(crate) busy_since: Option<Instant>,
    /// When another program's subject is looked at again.
    pub(crate) not_before: Option<Instant>,
    /// True where it must have the memory for itself.
    pub(crate) alone: bool,
}

impl Task {
    /// Memory to keep free for it, bytes; `seen` is the largest peak of the archive.
    pub(crate) fn memory(&self, seen: Option<u64>) -> u64 {
        memory_of(self.peak, seen)
    }

    /// How it ended.
    pub(crate) fn ended(&self, outcome: &Outcome) -> Ended {
        let why = (!outcome.has_result()).then(|| outcome.why());
        let told = match (&why, outcome.code) {
            (Some(_), _) => Fate::Failed,
            (None, Some(3)) => Fate::Lost,
            (None, Some(0)) => Fate::Done,
            (None, _) => Fate::FailedInPart,
        };
        let list = |key| Ended::sentences(&outcome.answer, key);
        Ended {
            subject: self.subject.clone(),
            outcome: told,
            why,
            attempts: self.attempts,
            seconds: outcome.seconds,
            cpu_seconds: self.cpu_seconds,
            peak_memory_bytes: outcome.peak_memory_bytes,
            warnings: list("warnings"),
            lost: list("lost"),
            failures: list("failures"),
        }
    }

    /// How it ended without a process.
    pub(crate) fn ended_as(&self, outcome: Fate, why: Option<String>) -> Ended {
        Ended {
            subject: self.subject.clone(),
            outcome,
            why,
            attempts: self.attempts,
            seconds: 0.0,
            cpu_seconds: self.cpu_seconds,
            peak_memory_bytes: 0,
            warnings: Vec::new(),
            lost: Vec::new(),
            failures: Vec::new(),
        }
    }
}
