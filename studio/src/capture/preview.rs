//! The live preview: a thread that fuses frames while they are recorded. It never holds the recording up: what it
//! cannot keep up with is dropped, the oldest first.

use std::{
    collections::VecDeque,
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError},
    thread::{self, JoinHandle},
};

use toile_capture::{Frame, Rig};
use toile_fusion::{Fuser, FusionSettings, Outcome, survey};

use super::{Pace, turn::Turn};

/// Frames that may wait.
const ROOM: usize = 8;
/// Frames that are kept until somebody is seen to move.
const MOST_KEPT: usize = 96;
/// Somebody is looked for when there are so many frames, and at every doubling.
const FIRST_LOOK: usize = 12;
/// Voxels of the preview, metres: eight times fewer than the scan's.
const VOXEL: f64 = 0.008;
/// So many frames in a row that cannot be placed start the preview anew.
const LOST: usize = 12;

/// What the preview knows.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Seen {
    /// Where the camera has been around the subject.
    pub turn: Turn,
    /// Frames that were fused.
    pub fused: usize,
    /// Frames that could not be placed.
    pub unplaced: usize,
    /// Frames that the preview did not look at, because it was behind.
    pub skipped: usize,
}

/// The thread and its queue.
pub struct Preview {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    pace: Pace,
}

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    queue: VecDeque<Frame>,
    seen: Seen,
    ends: bool,
    /// The thread has ended; nobody takes frames any more.
    over: bool,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn pop(&self) -> Option<Frame> {
        let mut state = self.lock();
        loop {
            if state.ends {
                return None;
            }
            if let Some(frame) = state.queue.pop_front() {
                self.changed.notify_all();
                return Some(frame);
            }
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

impl Preview {
    /// Starts the thread.
    ///
    /// # Errors
    /// What the system says where there are no threads left.
    pub fn start(rig: Rig, pace: Pace) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let its = shared.clone();
        let run = move || {
            follow(&rig, &its);
            its.lock().over = true;
            its.changed.notify_all();
        };
        let thread = thread::Builder::new().name("preview".into()).spawn(run)?;
        Ok(Self { shared, thread: Some(thread), pace })
    }

    /// Hands a frame over. A live device's frame takes the place of the oldest that waits; a device that can wait does.
    pub fn push(&self, frame: Frame) {
        let mut state = self.shared.lock();
        while state.queue.len() >= ROOM && !state.over {
            if self.pace == Pace::Live {
                state.queue.pop_front();
                state.seen.skipped += 1;
            } else {
                state = self.shared.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
            }
        }
        if !state.over {
            state.queue.push_back(frame);
        }
        drop(state);
        self.shared.changed.notify_all();
    }

    /// What it knows now.
    pub fn seen(&self) -> Seen {
        self.shared.lock().seen.clone()
    }

    /// Waits until every frame that was handed over has been looked at (devices that can wait), then ends the thread.
    pub fn finish(mut self) -> Seen {
        if self.pace == Pace::OnDemand {
            let mut state = self.shared.lock();
            while !state.queue.is_empty() && !state.over {
                state = self.shared.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
            }
        }
        self.end();
        self.seen()
    }

    fn end(&mut self) {
        self.shared.lock().ends = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            drop(thread.join());
        }
    }
}

impl Drop for Preview {
    fn drop(&mut self) {
        self.end();
    }
}

/// Looks for somebody who moves, then fuses; starts anew when it is lost.
fn follow(rig: &Rig, shared: &Shared) {
    let settings = FusionSettings { voxel_size: VOXEL, truncation: 4.0 * VOXEL, ..FusionSettings::default() };
    let mut kept: Vec<Frame> = Vec::new();
    let mut next_look = FIRST_LOOK;
    while let Some(frame) = shared.pop() {
        if frame.sensor != 0 || frame.depth.is_none() {
            continue;
        }
        kept.push(frame);
        if kept.len() < next_look {
            continue;
        }
        // Nobody moves yet, or too little: look again when there is twice as much.
        next_look = 2 * kept.len();
        if let Ok(volume) = survey(rig, &kept, &settings)
            && let Ok(fuser) = Fuser::new(rig, Some(volume), settings.clone())
        {
            fuse(fuser, std::mem::take(&mut kept), shared);
            next_look = FIRST_LOOK;
        }
        if kept.len() > MOST_KEPT {
            // Every other one tells the same about who moves.
            let mut keep = false;
            kept.retain(|_| {
                keep = !keep;
                keep
            });
            next_look = MOST_KEPT;
        }
    }
}

/// Fuses what was kept and what comes, until there is no more or it is lost.
fn fuse(mut fuser: Fuser, kept: Vec<Frame>, shared: &Shared) {
    shared.lock().seen.turn.start_anew();
    let mut lost = 0;
    let mut waiting: VecDeque<Frame> = kept.into();
    while let Some(frame) = waiting.pop_front().or_else(|| shared.pop()) {
        if shared.lock().ends {
            return;
        }
        if frame.sensor != 0 || frame.depth.is_none() {
            continue;
        }
        let outcome = fuser.push(&frame);
        let mut state = shared.lock();
        match outcome {
            Ok(Outcome::Fused { scan_from_camera, .. }) => {
                lost = 0;
                state.seen.fused += 1;
                state.seen.turn.push(&scan_from_camera);
            }
            Ok(Outcome::Dropped { .. }) => {
                lost += 1;
                state.seen.unplaced += 1;
            }
            Err(_) => return,
        }
        drop(state);
        if lost >= LOST {
            return;
        }
    }
}
