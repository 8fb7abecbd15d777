//! Running a batch: as many subjects side by side as processors and memory allow, each in a process of its own.

use std::{
    collections::VecDeque,
    path::Path,
    sync::{
        atomic::{AtomicBool, Ordering},
        mpsc::{Receiver, RecvTimeoutError, Sender, channel},
    },
    thread::{self, Scope},
    time::{Duration, Instant},
};

use toile_capture::{CaptureError, SubjectLock};
use toile_pipeline::{Options, Standing};

use super::{
    event::{Ended, Event, Fate},
    ledger::{Ledger, Totals},
    outlook::{Choice, Outlook, prospect},
    resources::Memory,
    task::Task,
    worker::{Outcome, Program, Running, process},
};
use crate::ArchiveError;

/// How often a subject is tried.
const ATTEMPTS: u32 = 2;
/// How often a subject that another program writes, and the wish to stop, are looked at.
const TICK: Duration = Duration::from_millis(200);

/// What a batch may use.
#[derive(Debug, Clone)]
pub struct Limits {
    /// Subjects side by side at most.
    pub workers: usize,
    /// Memory of all of them.
    pub memory: Memory,
    /// How long to wait for a subject that another program writes.
    pub patience: Duration,
}

/// Processes what is due in `outlook`. `hear` gets every event; `stop` asks for the end. A subject that fails is tried once
/// more, alone where a signal ended it, and then left in quarantine.
///
/// # Errors
/// [`ArchiveError`] where the archive's own files cannot be written. A subject that fails is told in the [`Totals`].
pub fn run(
    archive: &Path,
    outlook: &Outlook,
    program: &Program,
    options: &Options,
    limits: &Limits,
    stop: &AtomicBool,
    hear: &mut dyn FnMut(&Event),
) -> Result<Totals, ArchiveError> {
    let running = Running::default();
    let (send, receive) = channel();
    let mut batch = Batch::new(outlook, limits, Ledger::new(archive, outlook, options, hear));
    let result = thread::scope(|scope| {
        let crew = Crew { scope, program, archive, running: &running, send };
        let result = batch.work(&crew, &receive, stop);
        if result.is_err() {
            running.end_all();
        }
        result
    });
    result.map(|()| batch.ledger.close())
}

/// The threads that wait for processes.
struct Crew<'scope, 'env> {
    scope: &'scope Scope<'scope, 'env>,
    program: &'env Program,
    archive: &'env Path,
    running: &'env Running,
    send: Sender<(Task, Result<Outcome, ArchiveError>)>,
}

struct Batch<'a> {
    limits: &'a Limits,
    ledger: Ledger<'a>,
    queue: VecDeque<Task>,
    /// Memory kept for each process that runs.
    kept: Vec<(std::path::PathBuf, u64)>,
    /// The largest peak that was measured in this archive.
    seen: Option<u64>,
}

impl<'a> Batch<'a> {
    fn new(outlook: &Outlook, limits: &'a Limits, ledger: Ledger<'a>) -> Self {
        let seen = outlook.prospects.iter().filter_map(|p| p.plan.as_ref()?.peak_memory_bytes).max();
        let task = |(subject, plan): (&Path, &toile_pipeline::Plan)| Task {
            subject: subject.to_path_buf(),
            seconds: plan.seconds,
            peak: plan.peak_memory_bytes,
            attempts: 0,
            cpu_seconds: 0.0,
            busy_since: None,
            not_before: None,
            alone: false,
        };
        let mut queue: Vec<Task> = outlook.due().map(task).collect();
        // The longest first, so that the last ones end together.
        queue.sort_by(|a, b| b.seconds.total_cmp(&a.seconds).then_with(|| a.subject.cmp(&b.subject)));
        Self { limits, ledger, queue: queue.into(), kept: Vec::new(), seen }
    }

    fn work(
        &mut self,
        crew: &Crew<'_, '_>,
        receive: &Receiver<(Task, Result<Outcome, ArchiveError>)>,
        stop: &AtomicBool,
    ) -> Result<(), ArchiveError> {
        loop {
            if stop.load(Ordering::Relaxed) && !self.ledger.totals.stopped {
                self.ledger.totals.stopped = true;
                crew.running.end_all();
            }
            if self.ledger.totals.stopped || self.ledger.totals.disk_full {
                self.queue.clear();
            }
            while self.start_one(crew)? {}
            if self.kept.is_empty() && self.queue.is_empty() {
                return Ok(());
            }
            match receive.recv_timeout(TICK) {
                Ok((task, outcome)) => self.take_in(task, &outcome?)?,
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {}
            }
        }
    }

    /// Starts the first subject of the queue for which there is room; false where there is none.
    fn start_one(&mut self, crew: &Crew<'_, '_>) -> Result<bool, ArchiveError> {
        let mut at = 0;
        while at < self.queue.len() && self.kept.len() < self.limits.workers {
            if !self.has_room(&self.queue[at]) {
                at += 1;
                continue;
            }
            let Some(mut task) = self.queue.remove(at) else { return Ok(false) };
            if let Some(ended) = self.without_process(&task) {
                self.ledger.end(task.seconds, ended)?;
                return Ok(true);
            }
            if is_busy(&self.ledger.archive.join(&task.subject)) {
                self.put_off(task)?;
                continue;
            }
            task.attempts += 1;
            self.kept.push((task.subject.clone(), task.memory(self.seen)));
            self.ledger.totals.most_at_once = self.ledger.totals.most_at_once.max(self.kept.len());
            (self.ledger.hear)(&Event::Begins {
                subject: &task.subject,
                attempt: task.attempts,
                running: self.kept.len(),
            });
            let (program, archive, running, send) = (crew.program, crew.archive, crew.running, crew.send.clone());
            crew.scope.spawn(move || {
                let outcome = process(program, archive, &task.subject, running);
                // The receiver lives as long as the scope.
                drop(send.send((task, outcome)));
            });
            return Ok(true);
        }
        Ok(false)
    }

    fn has_room(&self, task: &Task) -> bool {
        let kept: u64 = self.kept.iter().map(|kept| kept.1).sum();
        let waits = task.not_before.is_some_and(|then| Instant::now() < then);
        let fits = !task.alone && kept + task.memory(self.seen) <= self.limits.memory.bytes;
        // One alone is always tried: nobody knows better.
        !waits && (self.kept.is_empty() || fits)
    }

    /// How a subject ended that another batch has finished since the plan was made.
    fn without_process(&self, task: &Task) -> Option<Ended> {
        if task.attempts > 0 {
            return None;
        }
        let now = prospect(
            self.ledger.archive,
            task.subject.clone(),
            self.ledger.options,
            &Choice { quarantined: true, ..Choice::default() },
        );
        match now.plan {
            Some(plan) if plan.standing == Standing::UpToDate => Some(task.ended_as(Fate::Elsewhere, None)),
            Some(_) => None,
            None => Some(task.ended_as(Fate::Failed, now.left)),
        }
    }

    /// Puts a subject that another program writes at the end of the queue, until patience ends.
    fn put_off(&mut self, mut task: Task) -> Result<(), ArchiveError> {
        let since = *task.busy_since.get_or_insert_with(Instant::now);
        if since.elapsed() > self.limits.patience {
            let why = "another toile is writing it; run the batch again when that has ended";
            let ended = task.ended_as(Fate::Busy, Some(why.into()));
            return self.ledger.end(task.seconds, ended);
        }
        if task.not_before.is_none() {
            (self.ledger.hear)(&Event::Busy { subject: &task.subject });
        }
        task.not_before = Some(Instant::now() + TICK);
        self.queue.push_back(task);
        Ok(())
    }

    /// Takes in how a process ended.
    fn take_in(&mut self, mut task: Task, outcome: &Outcome) -> Result<(), ArchiveError> {
        self.kept.retain(|kept| kept.0 != task.subject);
        task.cpu_seconds += outcome.cpu_seconds;
        self.ledger.totals.cpu_seconds += outcome.cpu_seconds;
        if outcome.kind() == "busy" {
            task.attempts -= 1;
            return self.put_off(task);
        }
        if self.ledger.totals.stopped && !outcome.has_result() {
            return Ok(());
        }
        self.seen = self.seen.max(Some(outcome.peak_memory_bytes));
        if outcome.has_result() || outcome.kind() == "disk-full" || task.attempts >= ATTEMPTS {
            self.ledger.totals.disk_full |= outcome.kind() == "disk-full";
            let ended = task.ended(outcome);
            return self.ledger.end(task.seconds, ended);
        }
        (self.ledger.hear)(&Event::Again { subject: &task.subject, why: &outcome.why() });
        task.alone = outcome.signal.is_some();
        task.peak = task.peak.max(Some(outcome.peak_memory_bytes));
        self.queue.push_back(task);
        Ok(())
    }
}

/// True where another program writes the subject just now.
fn is_busy(root: &Path) -> bool {
    matches!(SubjectLock::acquire(root), Err(CaptureError::Busy { .. }))
}
