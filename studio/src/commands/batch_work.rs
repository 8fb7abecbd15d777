//! The work of `toile batch` on a folder: running what is due while the session, the catalogue and the figures hear of it.

use std::{
    path::{Path, PathBuf},
    sync::{Arc, atomic::AtomicBool},
    time::Duration,
};

use serde_json::json;
use signal_hook::{
    consts::{SIGINT, SIGTERM},
    flag,
};
use toile_archive::{
    ArchiveError,
    batch::{
        Ended, Event, Limits, Metrics, MetricsPort, Outlook, Program, Ray, Totals, cores, memory, run, run_on_ray,
    },
    catalog::Catalog,
};
use toile_capture::printable_path;
use toile_pipeline::{Observer, Options, json::plain};

use super::batch_options::{Batch, Engine};
use crate::{StudioError, run::say_line, session::Session};

/// A batch at work.
pub(super) struct Work<'a> {
    pub(super) batch: &'a Batch,
    pub(super) session: &'a Session,
    pub(super) options: Options,
    /// Set by Ctrl-C, and by a polite request to end.
    pub(super) stop: Arc<AtomicBool>,
    /// This program.
    program: PathBuf,
    metrics: Metrics,
    port: Option<MetricsPort>,
    /// What could not be noted in the catalogue or in the figures; the work goes on without.
    pub(super) unnoted: Vec<ArchiveError>,
}

impl<'a> Work<'a> {
    /// Of a batch that begins with so many subjects, which take so many seconds.
    pub(super) fn begin(batch: &'a Batch, session: &'a Session, due: usize, seconds: f64) -> Result<Self, StudioError> {
        let program = std::env::current_exe().map_err(|error| StudioError::io(Path::new("toile"), error))?;
        let port = batch.metrics_port.map(MetricsPort::open).transpose()?;
        let metrics = Metrics::new(due);
        if let Some(port) = &port {
            let url = format!("http://{}/metrics", port.address);
            if session.globals.json {
                say_line(&json!({ "event": "metrics", "url": url }));
            }
            session.progress.say(&format!("figures of this batch: {url}"));
            port.show(&metrics);
        }
        session.progress.plan(seconds);
        let options = batch.options();
        Ok(Self { batch, session, options, stop: stop_flag()?, program, metrics, port, unnoted: Vec::new() })
    }

    /// Processes what is due in an archive; `heard` gets every subject that ends.
    pub(super) fn run(
        &mut self,
        archive: &Path,
        outlook: &Outlook,
        heard: &mut dyn FnMut(&Ended),
    ) -> Result<Totals, ArchiveError> {
        let (limits, threads) = limits(self.batch, outlook, self.session.globals.threads);
        let settings = self.batch.settings.clone();
        let program = Program { path: self.program.clone(), threads, settings };
        let mut catalog = Catalog::open(archive)?;
        let (batch, options, stop) = (self.batch, self.options.clone(), self.stop.clone());
        let mut hear = |event: &Event| {
            tell(event, self.session);
            self.count(event);
            if let Event::Ends { ended, .. } = event {
                self.unnoted.extend(catalog.note(ended).err());
                heard(ended);
            }
        };
        match batch.engine {
            Engine::Local => run(archive, outlook, &program, &options, &limits, &stop, &mut hear),
            Engine::Ray => {
                let (python, address) = (batch.python.clone(), batch.address.clone());
                let ray = Ray { python, address, patience: limits.patience };
                run_on_ray(archive, outlook, &program, &options, &ray, &stop, &mut hear)
            }
        }
    }

    fn count(&mut self, event: &Event) {
        self.metrics.hear(event);
        if let Some(port) = &self.port {
            port.show(&self.metrics);
        }
        self.unnoted.extend(self.batch.metrics.as_ref().and_then(|file| self.metrics.write(file).err()));
    }
}

/// Subjects side by side, and threads of each: one where there are subjects enough for all processors.
pub(super) fn limits(batch: &Batch, outlook: &Outlook, threads: usize) -> (Limits, usize) {
    let due = outlook.due().count().max(1);
    let workers = if batch.workers == 0 { cores().min(due) } else { batch.workers };
    let each = if batch.workers == 0 { cores() / workers } else { 1 };
    let threads = if threads == 0 { each.max(1) } else { threads };
    (Limits { workers, memory: memory(batch.memory), patience: Duration::from_secs(batch.wait) }, threads)
}

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
        Event::Ends { ended, done, of, expected_seconds, .. } => {
            let subject = printable_path(&ended.subject);
            tracing::info!(%subject, outcome = ended.word(), seconds = ended.seconds, "ends");
            // What was planned for it, whatever it took and whoever did it: so that the bar does not go back.
            session.progress.begin(&format!("{done} of {of} subjects, last {subject}"), *expected_seconds);
            session.progress.end();
        }
    }
}
