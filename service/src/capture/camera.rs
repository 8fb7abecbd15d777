//! The camera's thread: the newest frame for whoever looks, every frame for the recording.

use std::{
    collections::VecDeque,
    sync::{
        Arc, Condvar, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
        mpsc::{Receiver, SyncSender, TrySendError, sync_channel},
    },
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use toile_capture::{CaptureError, Frame, Rig, Source};

/// Frames that may wait for the recorder, which has a queue of its own behind this one.
const ROOM: usize = 300;
/// The rate is of this time.
const WINDOW: Duration = Duration::from_secs(2);
/// Unreadable frames in a row that end a camera.
const MOST_BROKEN: u32 = 30;

/// An open camera.
pub struct Camera {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

/// What the camera's thread and the others have in common.
pub struct Shared {
    /// The sensors.
    pub rig: Rig,
    ends: AtomicBool,
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    newest: Option<Newest>,
    number: u64,
    dropped: u64,
    arrivals: VecDeque<Instant>,
    recording: Option<SyncSender<Result<Frame, CaptureError>>>,
    /// Why there will be no more frames.
    ended: Option<String>,
}

/// The newest frame.
#[derive(Clone)]
pub struct Newest {
    /// The frame.
    pub frame: Frame,
    /// Counts all frames since the camera was opened.
    pub number: u64,
    /// When it arrived.
    pub at: Instant,
    /// Frames that the camera lost since it was opened.
    pub dropped: u64,
}

impl Camera {
    /// Begins to take frames from `source`.
    ///
    /// # Errors
    /// The system's error where no thread can be had.
    pub fn start(mut source: Box<dyn Source>) -> std::io::Result<Self> {
        let rig = source.rig().clone();
        let shared =
            Arc::new(Shared { rig, ends: AtomicBool::new(false), state: Mutex::default(), changed: Condvar::new() });
        let its = shared.clone();
        let thread = thread::Builder::new().name("camera".into()).spawn(move || its.run(&mut *source))?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// For those who look.
    pub fn shared(&self) -> Arc<Shared> {
        self.shared.clone()
    }
}

impl Drop for Camera {
    fn drop(&mut self) {
        self.shared.ends.store(true, Ordering::Release);
        self.shared.state().recording = None;
        if let Some(thread) = self.thread.take() {
            drop(thread.join());
        }
        self.shared.end("the camera was closed");
    }
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn run(&self, source: &mut dyn Source) {
        let mut broken = 0;
        while !self.ends.load(Ordering::Acquire) {
            match source.next_frame() {
                Ok(Some(frame)) => {
                    broken = 0;
                    self.take(frame);
                }
                Ok(None) => return self.end("the camera gives no more frames; open it again"),
                Err(error) => {
                    broken += 1;
                    let sentence = error.to_string();
                    let is_over = matches!(error, CaptureError::Device { .. }) || broken >= MOST_BROKEN;
                    self.record(Err(error));
                    if is_over {
                        return self.end(&sentence);
                    }
                }
            }
        }
    }

    fn take(&self, frame: Frame) {
        let mut state = self.state();
        let now = Instant::now();
        state.number += 1;
        state.dropped += u64::from(frame.lost_before);
        state.arrivals.push_back(now);
        while state.arrivals.front().is_some_and(|then| now.duration_since(*then) > WINDOW) {
            state.arrivals.pop_front();
        }
        let (number, dropped) = (state.number, state.dropped);
        state.newest = Some(Newest { frame: frame.clone(), number, at: now, dropped });
        drop(state);
        self.changed.notify_all();
        self.record(Ok(frame));
    }

    /// Hands a frame to the recording, which never holds the camera up.
    fn record(&self, frame: Result<Frame, CaptureError>) {
        let mut state = self.state();
        let Some(recording) = &state.recording else { return };
        match recording.try_send(frame) {
            Ok(()) => {}
            Err(TrySendError::Full(_)) => state.dropped += 1,
            Err(TrySendError::Disconnected(_)) => state.recording = None,
        }
    }

    fn end(&self, why: &str) {
        let mut state = self.state();
        state.recording = None;
        state.ended.get_or_insert_with(|| why.to_string());
        drop(state);
        self.changed.notify_all();
    }

    /// The frames from now on, for a recording.
    pub fn tap(&self) -> Tap {
        let (sender, receiver) = sync_channel(ROOM);
        let mut state = self.state();
        if state.ended.is_none() {
            state.recording = Some(sender);
        }
        Tap { rig: self.rig.clone(), receiver }
    }

    /// Nothing is recorded any more.
    pub fn close_tap(&self) {
        self.state().recording = None;
    }

    /// Why there will be no more frames.
    pub fn ended(&self) -> Option<String> {
        self.state().ended.clone()
    }

    /// Frames a second of late.
    pub fn fps(&self) -> f64 {
        let state = self.state();
        let (Some(first), Some(last)) = (state.arrivals.front(), state.arrivals.back()) else { return 0.0 };
        let seconds = last.duration_since(*first).as_secs_f64();
        if seconds > 0.0 { (state.arrivals.len() - 1) as f64 / seconds } else { 0.0 }
    }

    /// Waits for a frame after number `last`, at most `patience`.
    pub fn newer(&self, last: u64, patience: Duration) -> Option<Newest> {
        let mut state = self.state();
        let deadline = Instant::now() + patience;
        loop {
            if let Some(newest) = state.newest.as_ref().filter(|newest| newest.number > last) {
                return Some(newest.clone());
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() || state.ended.is_some() {
                return None;
            }
            state = self.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

/// The camera's frames as a source for the recorder.
pub struct Tap {
    rig: Rig,
    receiver: Receiver<Result<Frame, CaptureError>>,
}

impl Source for Tap {
    fn rig(&self) -> &Rig {
        &self.rig
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, CaptureError> {
        self.receiver.recv().ok().transpose()
    }
}
