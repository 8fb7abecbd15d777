//! `toile batch`: a whole archive.

use std::{
    path::{Path, PathBuf},
    sync::{Arc, atomic::AtomicBool},
    time::Duration,
};

use signal_hook::{
    consts::{SIGINT, SIGTERM},
    flag,
};
use toile_archive::{
    batch::{Choice, Event, Limits, Metrics, Outlook, Program, Ray, Version, cores, memory, run, run_on_ray},
    catalog::Catalog,
    compare::{self, compare, keep},
};
use toile_capture::printable_path;
use toile_pipeline::{Observer, Options, json::plain, steps::STEPS};

use super::{batch_report, reach::must_exist};
use crate::{StudioError, outcome::Answer, run::say_line, session::Session};

const AFTER: &str = "\
An archive is a folder that holds subjects, directly or in folders of its own. Each subject is processed by a process of its own, and
as many side by side as processors and memory allow. What is up to date is not done again; a batch that was killed goes on
where it was. A subject that fails is tried once more and then left out until it, its settings or the program change.

With --json, every event is a line of JSON; the last line is the answer.

Examples:
  toile batch archive --dry-run                  # what would be done, and how long it takes
  toile batch archive                            # with all processors
  toile batch archive --workers 2 --memory 1500M
  toile batch archive --stage cut --since-version 0.2
  toile batch archive --keep old --compare old   # what the new version made different
  toile batch archive --json | jq .";

/// Process a whole archive: what is stale, side by side
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Batch {
    /// Folder that holds subjects
    #[arg(value_name = "ARCHIVE")]
    archive: PathBuf,
    /// Say what would be done and how long it takes, and do nothing
    #[arg(long)]
    dry_run: bool,
    /// Subjects side by side at most (0: as many as there are processors)
    #[arg(long, default_value_t = 0, value_name = "N")]
    workers: usize,
    /// Memory for all of them, such as 1500M or 6G (without: what cgroup, ulimit and machine leave)
    #[arg(long, value_name = "SIZE", value_parser = size)]
    memory: Option<u64>,
    /// Only subjects whose results are of a program before this version
    #[arg(long, value_name = "VERSION")]
    since_version: Option<Version>,
    /// Only subjects in which this step has to run: fuse, fit, pose, cut, stack, export, report
    #[arg(long, value_name = "STEP", value_parser = step)]
    stage: Option<String>,
    /// Try subjects again that failed twice and have not changed since
    #[arg(long)]
    again: bool,
    /// Settings of the stages; they win over those of SUBJECT/toile.toml
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Keep the results that are replaced in this folder, for --compare
    #[arg(long, value_name = "DIR")]
    keep: Option<PathBuf>,
    /// Then compare the archive with these earlier results (a copy of it, or what --keep kept): accuracy proxies, overlap, measures, pictures
    #[arg(long, value_name = "OLD")]
    compare: Option<PathBuf>,
    /// Write figures in Prometheus' text format into this file while it runs
    #[arg(long, value_name = "FILE")]
    metrics: Option<PathBuf>,
    /// local: processes on this machine; ray: tasks on a Ray cluster (`pip install batch/` brings the bridge)
    #[arg(long, value_enum, default_value_t = Engine::Local)]
    engine: Engine,
    /// Of a Ray cluster, or `auto`; without, one is started on this machine for this batch
    #[arg(long, value_name = "ADDRESS")]
    address: Option<String>,
    /// The Python that has the bridge
    #[arg(long, value_name = "FILE", default_value = "python3")]
    python: PathBuf,
    /// How long to wait for a subject that another program writes, seconds
    #[arg(long, default_value_t = 600, value_name = "SECONDS")]
    wait: u64,
}

/// Who runs the subjects' processes.
#[derive(Debug, Clone, Copy, PartialEq, clap::ValueEnum)]
enum Engine {
    Local,
    Ray,
}

impl Batch {
    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] where the archive cannot be read or written; a subject that fails is named in the answer.
    pub fn run(&self, session: &Session) -> Result<Answer, StudioError> {
        must_exist(&self.archive)?;
        let options = Options { settings: self.settings.clone(), ..Options::default() };
        let choice =
            Choice { since_version: self.since_version.clone(), stage: self.stage.clone(), quarantined: self.again };
        let outlook = Outlook::new(&self.archive, &options, &choice)?;
        let (limits, threads) = self.limits(&outlook, session.globals.threads);
        if self.dry_run {
            return batch_report::outlook(&outlook, &limits);
        }
        if let Some(old) = &self.keep {
            outlook.due().try_for_each(|(subject, _)| keep(&self.archive.join(subject), &old.join(subject)))?;
        }
        let path = std::env::current_exe().map_err(|error| StudioError::io(Path::new("toile"), error))?;
        let program = Program { path, threads, settings: self.settings.clone() };
        let stop = stop_flag()?;
        let mut catalog = Catalog::open(&self.archive)?;
        let mut unnoted = Vec::new();
        session.progress.plan(outlook.seconds());
        let mut metrics = Metrics::new(outlook.due().count());
        let mut hear = |event: &Event| {
            tell(event, session);
            metrics.hear(event);
            unnoted.extend(self.metrics.as_ref().and_then(|file| metrics.write(file).err()));
            if let Event::Ends { ended, .. } = event {
                unnoted.extend(catalog.note(ended).err());
            }
        };
        let totals = match self.engine {
            Engine::Local => run(&self.archive, &outlook, &program, &options, &limits, &stop, &mut hear)?,
            Engine::Ray => {
                let (python, address) = (self.python.clone(), self.address.clone());
                let ray = Ray { python, address, patience: limits.patience };
                run_on_ray(&self.archive, &outlook, &program, &options, &ray, &stop, &mut hear)?
            }
        };
        let mut answer = batch_report::totals(&outlook, &totals)?;
        answer.warnings.extend(unnoted.first().map(ToString::to_string));
        if let Some(old) = &self.compare {
            let changes = compare(&self.archive, old)?;
            let page = compare::write(&changes, &self.archive, old, &self.archive.join(".toile/compare"))?;
            let same = changes.iter().filter(|change| change.is_none()).count();
            let (all, page) = (changes.len(), printable_path(&page));
            answer.text.push_str(&format!("{all} subjects compared, {same} of them the same: look at {page}\n"));
            answer.results["compared"] = plain(&changes)?;
        }
        Ok(answer)
    }

    /// Subjects side by side, and threads of each: one where there are subjects enough for all processors.
    fn limits(&self, outlook: &Outlook, threads: usize) -> (Limits, usize) {
        let due = outlook.due().count().max(1);
        let workers = if self.workers == 0 { cores().min(due) } else { self.workers };
        let each = if self.workers == 0 { cores() / workers } else { 1 };
        let threads = if threads == 0 { each.max(1) } else { threads };
        (Limits { workers, memory: memory(self.memory), patience: Duration::from_secs(self.wait) }, threads)
    }
}

/// Set by Ctrl-C, and by a polite request to end.
fn stop_flag() -> Result<Arc<AtomicBool>, StudioError> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        flag::register(signal, stop.clone()).map_err(StudioError::Signal)?;
    }
    Ok(stop)
}

/// Tells an event: a line of JSON, or the progress and a line of the log.
fn tell(event: &Event, session: &Session) {
    if session.globals.json {
        say_line(&plain(event).unwrap_or_default());
    }
    match event {
        Event::Begins { subject, attempt, running } => {
            tracing::info!(subject = %printable_path(subject), attempt, running, "begins");
        }
        Event::Again { subject, why } => {
            tracing::warn!(subject = %printable_path(subject), why, "failed and is tried once more");
        }
        Event::Busy { subject } => {
            tracing::info!(subject = %printable_path(subject), "another program writes it; it comes later");
        }
        Event::Ends { ended, done, of, .. } => {
            let subject = printable_path(&ended.subject);
            tracing::info!(%subject, outcome = ended.word(), seconds = ended.seconds, "ends");
            session.progress.begin(&format!("{done} of {of} subjects, last {subject}"), ended.seconds);
            session.progress.end();
        }
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
