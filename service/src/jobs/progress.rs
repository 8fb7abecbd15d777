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
use toile_pipeline::Observer;

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
    label: String,
    /// Expected seconds of what is still to be done, the running step included; of what is done; and of the running step.
    ahead: f64,
    done: f64,
    step: f64,
    fraction: f64,
    started: Instant,
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
        let state = State {
            log,
            label: String::new(),
            ahead: 0.0,
            done: 0.0,
            step: 0.0,
            fraction: 0.0,
            started: Instant::now(),
            told: None,
        };
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
    let seconds = state.started.elapsed().as_secs_f64();
    // The log is for people; that it cannot be written must not stop the work.
    drop(writeln!(state.log, "{seconds:8.1} s  {}", printable(line)));
}

fn progress(state: &State) -> Progress {
    let (whole, done) = ((state.done + state.ahead).max(1e-9), state.done + state.fraction * state.step);
    let elapsed = state.started.elapsed().as_secs_f64();
    // Too little is done for an estimate before that.
    let is_known = done > 0.02 * whole && elapsed > 1.0;
    let left = is_known.then(|| (elapsed * (whole - done) / done).max(0.0));
    Progress { step: state.label.clone(), fraction: (done / whole).clamp(0.0, 1.0), seconds_left: left, paused: false }
}

impl Observer for Hearing<'_> {
    fn plan(&self, cost: f64) {
        self.state().ahead += cost;
    }

    fn skip(&self, cost: f64) {
        self.stop_or_wait();
        let mut state = self.state();
        state.ahead = (state.ahead - cost).max(0.0);
    }

    fn begin(&self, label: &str, cost: f64) {
        self.stop_or_wait();
        let mut state = self.state();
        (state.label, state.step, state.fraction) = (printable(label).into_owned(), cost, 0.0);
        state.ahead = state.ahead.max(cost);
        say(&mut state, label);
        self.told(&mut state, true);
    }

    fn at(&self, fraction: f32) {
        self.stop_or_wait();
        let mut state = self.state();
        state.fraction = f64::from(fraction).clamp(state.fraction, 1.0);
        self.told(&mut state, false);
    }

    fn end(&self) {
        let mut state = self.state();
        state.ahead = (state.ahead - state.step).max(0.0);
        state.done += state.step;
        (state.step, state.fraction) = (0.0, 0.0);
    }

    fn remark(&self, sentence: &str) {
        self.say(sentence);
    }
}
