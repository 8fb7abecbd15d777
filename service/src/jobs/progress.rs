//! How far a job is: what the pipeline says, as numbers, lines of the log, and a place where the job can stop or wait.

use std::{
    fs::File,
    io::Write,
    panic::resume_unwind,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use toile_capture::printable;
use toile_pipeline::{Account, Observer};

use crate::yielding::Priority;

/// How often progress is told.
const TELL_EVERY: Duration = Duration::from_millis(250);

/// What a cancelled job unwinds with. The pipeline writes files whole or not at all, so a step may end anywhere.
pub struct Cancelled;

/// How far a job is.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Progress {
    /// What it does now.
    pub step: String,
    /// How much is done, 0 to 1.
    pub fraction: f64,
    /// Seconds left, where that can be told.
    pub seconds_left: Option<f64>,
    /// It waits for a take that is being recorded.
    pub paused: bool,
}

/// Hears the pipeline, tells the queue, stops the job when it is cancelled, and holds it while a take is recorded.
pub struct Hearing<'a> {
    cancel: &'a AtomicBool,
    priority: Arc<Priority>,
    tell: &'a (dyn Fn(Progress) + Sync),
    state: Mutex<State>,
}

struct State {
    log: File,
    account: Account,
    told: Option<Instant>,
}

impl<'a> Hearing<'a> {
    /// Begins to hear a job.
    pub fn new(
        cancel: &'a AtomicBool,
        priority: Arc<Priority>,
        log: File,
        tell: &'a (dyn Fn(Progress) + Sync),
    ) -> Self {
        let state = State { log, account: Account::default(), told: None };
        Self { cancel, priority, tell, state: Mutex::new(state) }
    }

    /// Writes a line into the log.
    pub fn say(&self, line: &str) {
        say(&mut self.state(), line);
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Ends the job where it was cancelled, and waits while a take is recorded.
    fn stop_or_wait(&self) {
        if self.priority.is_wanted() {
            let mut progress = progress(&self.state());
            progress.paused = true;
            (self.tell)(progress);
            self.priority.wait(|| self.cancel.load(Ordering::Acquire));
            self.state().told = None;
        }
        if self.cancel.load(Ordering::Acquire) {
            resume_unwind(Box::new(Cancelled));
        }
    }

    fn told(&self, state: &mut State, at_once: bool) {
        if at_once || state.told.is_none_or(|then| then.elapsed() >= TELL_EVERY) {
            state.told = Some(Instant::now());
            (self.tell)(progress(state));
        }
    }
}

fn say(state: &mut State, line: &str) {
    let seconds = state.account.elapsed().as_secs_f64();
    // The log is for people; that it cannot be written must not stop the work.
    drop(writeln!(state.log, "{seconds:8.1} s  {}", printable(line)));
}

fn progress(state: &State) -> Progress {
    let account = &state.account;
    let (step, fraction, seconds_left) = (account.label().to_string(), account.share(), account.seconds_left());
    Progress { step, fraction, seconds_left, paused: false }
}

impl Observer for Hearing<'_> {
    fn plan(&self, cost: f64) {
        self.state().account.plan(cost);
    }

    fn skip(&self, cost: f64) {
        self.stop_or_wait();
        self.state().account.skip(cost);
    }

    fn begin(&self, label: &str, cost: f64) {
        self.stop_or_wait();
        let mut state = self.state();
        state.account.begin(label, cost);
        say(&mut state, label);
        self.told(&mut state, true);
    }

    fn at(&self, fraction: f32) {
        self.stop_or_wait();
        let mut state = self.state();
        state.account.at(f64::from(fraction));
        self.told(&mut state, false);
    }

    fn end(&self) {
        self.state().account.end();
    }

    fn remark(&self, sentence: &str) {
        self.say(sentence);
    }
}
