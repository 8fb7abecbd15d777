//! Capture comes first: while a take is recorded, heavy work waits, and always runs with the least priority.

use std::{
    sync::{
        Condvar, Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    time::Duration,
};

/// The lowest priority that the system knows: such a thread runs when nobody else wants the processor.
const NICE: i32 = 19;
/// How often one that waits looks whether it was cancelled.
const LOOK_EVERY: Duration = Duration::from_millis(200);

/// Who is recording now; whoever works in the background waits at its next step.
#[derive(Debug, Default)]
pub struct Priority {
    recording: Mutex<usize>,
    waiting: AtomicUsize,
    changed: Condvar,
}

impl Priority {
    /// A take begins: heavy work waits from now on.
    pub fn take(&self) {
        *self.recording.lock().unwrap_or_else(PoisonError::into_inner) += 1;
    }

    /// The take has ended.
    pub fn give_back(&self) {
        let mut recording = self.recording.lock().unwrap_or_else(PoisonError::into_inner);
        *recording = recording.saturating_sub(1);
        drop(recording);
        self.changed.notify_all();
    }

    /// True while a take is recorded.
    pub fn is_wanted(&self) -> bool {
        *self.recording.lock().unwrap_or_else(PoisonError::into_inner) > 0
    }

    /// Waits until no take is recorded, or `is_over`.
    pub fn wait(&self, is_over: impl Fn() -> bool) {
        self.waiting.fetch_add(1, Ordering::Relaxed);
        let mut recording = self.recording.lock().unwrap_or_else(PoisonError::into_inner);
        while *recording > 0 && !is_over() {
            let waited = self.changed.wait_timeout(recording, LOOK_EVERY);
            recording = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        drop(recording);
        self.waiting.fetch_sub(1, Ordering::Relaxed);
    }

    /// True while heavy work waits.
    pub fn has_waiting(&self) -> bool {
        self.waiting.load(Ordering::Relaxed) > 0
    }
}

/// Gives the calling thread the least priority. Where the system does not allow that, it keeps its own.
pub fn step_back() {
    let thread = rustix::thread::gettid();
    let _ = rustix::process::setpriority_process(Some(thread), NICE);
}
