//! What `toile batch` can be told.

use std::path::PathBuf;

use toile_archive::batch::{Choice, Version};
use toile_pipeline::{Options, steps::STEPS};

const AFTER: &str = "\
An archive is a folder that holds subjects, directly or in folders of its own. Each subject is processed by a process of its own, and
as many side by side as processors and memory allow. What is up to date is not done again; a batch that was killed goes on
where it was. A subject that fails is tried once more and then left out until it, its settings or the program change.

An archive in a bucket (s3://, gs://, az://) is fetched into a cache subject by subject, processed there, and its results are sent back.
Credentials come from the environment (AWS_ACCESS_KEY_ID and the like).

With --json, every event is a line of JSON; the last line is the answer.

Examples:
  toile batch archive --dry-run                  # what would be done, and how long it takes
  toile batch archive                            # with all processors
  toile batch archive --workers 2 --memory 1500M
  toile batch archive --stage cut --since-version 0.2
  toile batch archive --keep old --compare old   # what the new version made different
  toile batch archive --json | jq .
  toile batch s3://bucket/archive --cache /fast/disk --cache-size 200G";

/// Process a whole archive: what is stale, side by side
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Batch {
    /// Folder that holds subjects, or s3://BUCKET/PREFIX, gs://BUCKET/PREFIX, az://CONTAINER/PREFIX
    #[arg(value_name = "ARCHIVE")]
    pub(super) archive: PathBuf,
    /// Say what would be done and how long it takes, and do nothing
    #[arg(long)]
    pub(super) dry_run: bool,
    /// Subjects side by side at most (0: as many as there are processors)
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub(super) workers: usize,
    /// Memory for all of them, such as 1500M or 6G (without: what cgroup, ulimit and machine leave)
    #[arg(long, value_name = "SIZE", value_parser = size)]
    pub(super) memory: Option<u64>,
    /// Only subjects whose results are of a program before this version
    #[arg(long, value_name = "VERSION")]
    pub(super) since_version: Option<Version>,
    /// Only subjects in which this step has to run: fuse, fit, pose, cut, stack, export, report
    #[arg(long, value_name = "STEP", value_parser = step)]
    pub(super) stage: Option<String>,
    /// Try subjects again that failed twice and have not changed since
    #[arg(long)]
    pub(super) again: bool,
    /// Settings of the stages; they win over those of SUBJECT/toile.toml
    #[arg(long, value_name = "FILE")]
    pub(super) settings: Option<PathBuf>,
    /// Keep the results that are replaced in this folder, for --compare
    #[arg(long, value_name = "DIR")]
    pub(super) keep: Option<PathBuf>,
    /// Then compare the archive with these earlier results (a copy of it, or what --keep kept): accuracy proxies, overlap, measures, pictures
    #[arg(long, value_name = "OLD")]
    pub(super) compare: Option<PathBuf>,
    /// Write figures in Prometheus' text format into this file while it runs
    #[arg(long, value_name = "FILE")]
    pub(super) metrics: Option<PathBuf>,
    /// Serve the same figures at http://127.0.0.1:N/metrics while it runs (0: any free port, which is told)
    #[arg(long, value_name = "N")]
    pub(super) metrics_port: Option<u16>,
    /// For an archive in a bucket: where subjects are processed (without: in the user's cache)
    #[arg(long, value_name = "DIR")]
    pub(super) cache: Option<PathBuf>,
    /// For an archive in a bucket: how large the cache may become
    #[arg(long, value_name = "SIZE", value_parser = size, default_value = "20G")]
    pub(super) cache_size: u64,
    /// local: processes on this machine; ray: tasks on a Ray cluster (`pip install batch/` brings the bridge)
    #[arg(long, value_enum, default_value_t = Engine::Local)]
    pub(super) engine: Engine,
    /// Of a Ray cluster, or `auto`; without, one is started on this machine for this batch
    #[arg(long, value_name = "ADDRESS")]
    pub(super) address: Option<String>,
    /// The Python that has the bridge
    #[arg(long, value_name = "FILE", default_value = "python3")]
    pub(super) python: PathBuf,
    /// How long to wait for a subject that another program writes, seconds
    #[arg(long, default_value_t = 600, value_name = "SECONDS")]
    pub(super) wait: u64,
}

/// Who runs the subjects' processes.
#[derive(Debug, Clone, Copy, PartialEq, clap::ValueEnum)]
pub(super) enum Engine {
    Local,
    Ray,
}

impl Batch {
    /// The options of every run.
    pub(super) fn options(&self) -> Options {
        Options { settings: self.settings.clone(), ..Options::default() }
    }

    /// Which subjects are meant.
    pub(super) fn choice(&self) -> Choice {
        let (since_version, stage) = (self.since_version.clone(), self.stage.clone());
        Choice { since_version, stage, quarantined: self.again }
    }
}

/// A size such as `1500M`, `1.5G` or a number of bytes.
fn size(text: &str) -> Result<u64, String> {
    let wrong = || format!("`{text}` is not a size such as 1500M or 1.5G");
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let factor = match text[digits.len()..].to_ascii_uppercase().trim_end_matches("IB").trim_end_matches('B') {
        "" => 1.0,
        "K" => 1024.0,
        "M" => 1024.0 * 1024.0,
        "G" => 1024.0 * 1024.0 * 1024.0,
        _ => return Err(wrong()),
    };
    let bytes = factor * digits.parse::<f64>().map_err(|_| wrong())?;
    if (1.0..1e15).contains(&bytes) { Ok(bytes as u64) } else { Err(wrong()) }
}

fn step(text: &str) -> Result<String, String> {
    if STEPS.iter().any(|step| step.name == text) {
        return Ok(text.to_string());
    }
    let names: Vec<&str> = STEPS.iter().map(|step| step.name).collect();
    Err(format!("there is no step `{text}`; there are: {}", names.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_with_and_without_units() {
        assert_eq!(size("1.5G"), Ok(1_610_612_736));
        assert_eq!(size("1500M"), size("1500MiB"));
        assert_eq!((size("7"), size("7kB")), (Ok(7), Ok(7168)));
        for text in ["", "G", "-1G", "1X", "nan", "1e99"] {
            assert!(size(text).is_err(), "{text}");
        }
    }

    #[test]
    fn steps_are_known_by_name() {
        assert!(step("cut").is_ok() && step("glue").unwrap_err().contains("stack"));
    }
}
