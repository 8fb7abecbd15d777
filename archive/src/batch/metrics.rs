//! Figures of a batch in Prometheus' text format: in a file, for the textfile collector of its node exporter, or at a port.

use std::{collections::BTreeMap, fmt::Write, path::Path};

use toile_capture::files::atomic_write;

use super::event::{Event, Fate};
use crate::ArchiveError;

/// What was counted so far.
#[derive(Debug, Clone, Default)]
pub struct Metrics {
    due: usize,
    running: usize,
    ended: BTreeMap<&'static str, usize>,
    again: usize,
    seconds: f64,
    cpu_seconds: f64,
    peak_memory_bytes: u64,
    seconds_left: f64,
}

impl Metrics {
    /// Of a batch that begins with so many subjects.
    pub fn new(due: usize) -> Self {
        Self { due, ..Self::default() }
    }

    /// Takes in what a batch tells.
    pub fn hear(&mut self, event: &Event) {
        match event {
            Event::Begins { running, .. } => self.running = *running,
            Event::Again { .. } => {
                self.again += 1;
                self.running = self.running.saturating_sub(1);
            }
            Event::Busy { .. } => {}
            Event::Ends { ended, seconds_left, .. } => {
                *self.ended.entry(label(ended.outcome)).or_default() += 1;
                self.running = self.running.saturating_sub(1);
                self.seconds += ended.seconds;
                self.cpu_seconds += ended.cpu_seconds;
                self.peak_memory_bytes = self.peak_memory_bytes.max(ended.peak_memory_bytes);
                self.seconds_left = *seconds_left;
            }
        }
    }

    /// Writes them, whole.
    ///
    /// # Errors
    /// [`ArchiveError`] where the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), ArchiveError> {
        Ok(atomic_write(path, self.text().as_bytes())?)
    }

    /// All of them as text.
    pub(super) fn text(&self) -> String {
        let mut text = String::new();
        let mut gauge = |name: &str, kind: &str, help: &str, value: f64| {
            let _ = writeln!(
                text,
                "# HELP toile_batch_{name} {help}\n# TYPE toile_batch_{name} {kind}\ntoile_batch_{name} {value}"
            );
        };
        gauge("subjects_due", "gauge", "Subjects that had to run when the batch began.", self.due as f64);
        gauge("subjects_running", "gauge", "Subjects that run now.", self.running as f64);
        gauge("retries_total", "counter", "Subjects that failed and were tried once more.", self.again as f64);
        gauge("subject_seconds_total", "counter", "Seconds of all subjects that ended.", self.seconds);
        gauge(
            "subject_cpu_seconds_total",
            "counter",
            "Processor seconds of all subjects that ended.",
            self.cpu_seconds,
        );
        gauge(
            "peak_memory_bytes",
            "gauge",
            "The most resident memory that a subject needed.",
            self.peak_memory_bytes as f64,
        );
        gauge("seconds_left", "gauge", "Expected seconds until the end.", self.seconds_left);
        text.push_str("# HELP toile_batch_subjects_total Subjects that ended, by how.\n# TYPE toile_batch_subjects_total counter\n");
        for (outcome, count) in &self.ended {
            let _ = writeln!(text, "toile_batch_subjects_total{{outcome=\"{outcome}\"}} {count}");
        }
        text
    }
}

fn label(fate: Fate) -> &'static str {
    match fate {
        Fate::Done => "done",
        Fate::Lost => "lost",
        Fate::FailedInPart => "failed_in_part",
        Fate::Failed => "failed",
        Fate::Busy => "busy",
        Fate::Elsewhere => "elsewhere",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_follow_the_events() {
        let mut metrics = Metrics::new(3);
        metrics.hear(&Event::Begins { subject: Path::new("a"), attempt: 1, running: 2 });
        let ended = serde_json::json!({ "subject": "a", "outcome": "done", "why": null, "attempts": 1, "seconds": 2.5,
            "cpu_seconds": 2.0, "peak_memory_bytes": 7, "warnings": [], "lost": [], "failures": [] });
        let ended = serde_json::from_value(ended).unwrap();
        metrics.hear(&Event::Ends { ended: &ended, done: 1, of: 3, expected_seconds: 2.0, seconds_left: 5.0 });
        let text = metrics.text();
        for line in
            ["subjects_due 3", "subjects_running 1", "subject_seconds_total 2.5", "subjects_total{outcome=\"done\"} 1"]
        {
            assert!(text.contains(&format!("\ntoile_batch_{line}\n")), "{line} is not in {text}");
        }
    }
}
