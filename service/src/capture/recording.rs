//! A take from its first frame to a whole file.

use std::{
    path::PathBuf,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    thread::{self, JoinHandle},
    time::Instant,
};

use toile_live::{LiveError, Pace, Recorded, Status, Stop, Surfaces, record_seen};

use super::{Shared, Step, camera, pictures::Take};

/// A recording that runs, or has ended and waits.
pub struct Recording {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    result: Arc<Mutex<Option<Result<Recorded, String>>>>,
}

impl Recording {
    /// Records from `camera` to `path` until the subject has turned once round, or it is stopped.
    ///
    /// # Errors
    /// The system's error where no thread can be had.
    pub fn start(
        shared: &Arc<Shared>,
        camera: Arc<camera::Shared>,
        path: PathBuf,
        take: Arc<Mutex<Take>>,
        surfaces: Surfaces,
    ) -> std::io::Result<Self> {
        let (stop, result) = (Arc::new(AtomicBool::new(false)), Arc::new(Mutex::new(None)));
        let (its_stop, its_result, shared) = (stop.clone(), result.clone(), shared.clone());
        let run = move || {
            let priority = shared.priority.clone();
            priority.take();
            let began = Instant::now();
            begin(&take, began);
            let mut report = |status: &Status| told(&shared, &camera, &take, began, status);
            let how = (Stop::AfterOneTurn, Pace::Live);
            let tap = Box::new(camera.tap());
            let recorded = record_seen(tap, &path, how, &its_stop, Some(surfaces), &mut report);
            camera.close_tap();
            priority.give_back();
            take.lock().unwrap_or_else(PoisonError::into_inner).began = None;
            let recorded = recorded.map_err(|error| sentence(&error, &path));
            shared.set(|now| ended(now, &recorded, &path, began));
            *its_result.lock().unwrap_or_else(PoisonError::into_inner) = Some(recorded);
        };
        let thread = thread::Builder::new().name("recording".into()).spawn(run)?;
        Ok(Self { stop, thread: Some(thread), result })
    }

    /// Ends it soon, whole.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Release);
    }

    /// True once the file is whole or has failed.
    pub fn is_over(&self) -> bool {
        self.result.lock().unwrap_or_else(PoisonError::into_inner).is_some()
    }

    /// True where there is a whole file.
    pub fn is_whole(&self) -> bool {
        self.result.lock().unwrap_or_else(PoisonError::into_inner).as_ref().is_some_and(Result::is_ok)
    }

    /// Waits for its end.
    pub fn join(&mut self) {
        if let Some(thread) = self.thread.take() {
            drop(thread.join());
        }
    }
}

impl Drop for Recording {
    fn drop(&mut self) {
        self.stop();
        self.join();
    }
}

fn begin(take: &Mutex<Take>, began: Instant) {
    let mut take = take.lock().unwrap_or_else(PoisonError::into_inner);
    *take = Take { began: Some(began), number: take.number + 1, seen: toile_live::TurnSeen::default() };
}

/// Several times a second while it is recorded.
fn told(shared: &Shared, camera: &camera::Shared, take: &Mutex<Take>, began: Instant, status: &Status) {
    take.lock().unwrap_or_else(PoisonError::into_inner).seen = status.seen.clone();
    let (fps, job_paused) = (camera.fps(), shared.priority.has_waiting());
    shared.set(|now| {
        if now.state == Step::Opening || now.state == Step::Preview {
            now.state = Step::Recording;
        }
        (now.seconds, now.frames, now.dropped, now.fps) =
            (began.elapsed().as_secs_f64(), status.frames, status.lost, fps);
        (now.degrees, now.turned) = (status.seen.turn.angle().to_degrees(), status.seen.turn.is_full());
        now.unseen = status.seen.turn.unseen().iter().map(ToString::to_string).collect();
        (now.disk_free_bytes, now.job_paused) = (status.disk_left, job_paused);
    });
}

fn ended(now: &mut super::Now, recorded: &Result<Recorded, String>, path: &std::path::Path, began: Instant) {
    now.seconds = began.elapsed().as_secs_f64();
    now.job_paused = false;
    match recorded {
        Err(error) => (now.state, now.error) = (Step::Failed, Some(error.clone())),
        Ok(recorded) => {
            (now.state, now.frames, now.dropped) = (Step::Review, recorded.frames, recorded.lost);
            now.take_file = path.file_name().map(|name| format!("takes/{}", name.to_string_lossy()));
            (now.degrees, now.turned) = (recorded.seen.turn.angle().to_degrees(), recorded.seen.turn.came_round());
            now.unseen = recorded.seen.turn.unseen().iter().map(ToString::to_string).collect();
            now.warnings = warnings(recorded);
            now.error.clone_from(&recorded.failed);
        }
    }
}

/// What is to be known of a take, a sentence each.
fn warnings(recorded: &Recorded) -> Vec<String> {
    let turn = &recorded.seen.turn;
    let (angle, unseen) = (turn.angle().to_degrees(), turn.unseen().join(", "));
    let sides = if unseen.is_empty() { String::new() } else { format!("; not seen: {unseen}") };
    let all = [
        (
            recorded.lost > 0,
            format!("{} frames were lost between camera and computer; the others are whole", recorded.lost),
        ),
        (recorded.unpaired > 0, format!("{} frames have only depth or only colour", recorded.unpaired)),
        (!recorded.broken.is_empty(), format!("{} frames could not be read", recorded.broken.len())),
        (
            !turn.came_round(),
            format!("the preview followed {angle:.0}° of the turn{sides}; record it again where a side is missing"),
        ),
    ];
    all.into_iter().filter(|(is_so, _)| *is_so).map(|(_, sentence)| sentence).collect()
}

/// The sentence about a recording that failed, with what is left of it.
fn sentence(error: &LiveError, path: &std::path::Path) -> String {
    let part = toile_capture::files::part_path(path);
    if part.exists() {
        let name = part.file_name().unwrap_or_default().to_string_lossy().into_owned();
        return format!("{error}; what was recorded until then is kept as takes/{name}");
    }
    error.to_string()
}
