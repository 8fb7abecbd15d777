//! The live preview: a thread that fuses frames while they are recorded. It never holds the recording up: what it
//! cannot keep up with is dropped, the oldest first.

use std::{
    collections::VecDeque,
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError},
    thread::{self, JoinHandle},
};

use toile_capture::{Frame, Rig};
use toile_fusion::{FusionSettings, LiveFuser, Outcome, survey};
use toile_geometry::Rigid;

use crate::{
    stop::Pace,
    surface::{Growing, Surfaces},
    turn::Turn,
};

/// Frames of each sensor that may wait.
const ROOM: usize = 8;
/// Frames that are kept until somebody is seen to move.
const MAX_KEPT: usize = 96;
/// The preview looks for a person once this many frames have arrived, and again at every doubling.
const FIRST_LOOK: usize = 12;
/// Voxels of the preview, metres: eight times fewer than the scan's.
const VOXEL: f64 = 0.008;
/// This many frames in a row that cannot be placed start the preview anew.
const LOST: usize = 12;
/// A sensor that gave no depth while this many frames came from others counts as silent.
const QUIET: u64 = 90;

/// The findings of the preview.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TurnSeen {
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
    room: usize,
}

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    queue: VecDeque<Frame>,
    seen: TurnSeen,
    ends: bool,
    /// The thread has ended; nobody takes frames any more.
    over: bool,
}

/// Says that nobody takes frames any more, also where fusing panics: the recording goes on.
struct Over(Arc<Shared>);

impl Drop for Over {
    fn drop(&mut self) {
        self.0.lock().over = true;
        self.0.changed.notify_all();
    }
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
    /// The system's error where there are no threads left.
    pub fn start(rig: Rig, pace: Pace, surfaces: Option<Surfaces>) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let its = shared.clone();
        let room = ROOM * rig.sensors.len().max(1);
        let run = move || {
            let over = Over(its);
            follow(&rig, &over.0, &mut Growing::new(surfaces));
        };
        let thread = thread::Builder::new().name("preview".into()).spawn(run)?;
        Ok(Self { shared, thread: Some(thread), pace, room })
    }

    /// Hands a frame over. A live device's frame takes the place of the oldest that waits; a device that can wait does.
    pub fn push(&self, frame: Frame) {
        let mut state = self.shared.lock();
        while state.queue.len() >= self.room && !state.over {
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

    /// The findings so far.
    pub fn seen(&self) -> TurnSeen {
        self.shared.lock().seen.clone()
    }

    /// Waits until every frame that was handed over has been looked at (devices that can wait), then ends the thread.
    pub fn finish(mut self) -> TurnSeen {
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

/// The sensors of the rig, one of which is followed: the first that gives depth.
struct Sensors<'a> {
    rig: &'a Rig,
    shared: &'a Shared,
    /// Which one is followed.
    leader: usize,
    /// Depth frames that came, and how many had come at each sensor's last one.
    frames: u64,
    last: Vec<Option<u64>>,
}

impl<'a> Sensors<'a> {
    fn new(rig: &'a Rig, shared: &'a Shared) -> Self {
        Self { rig, shared, leader: 0, frames: 0, last: vec![None; rig.sensors.len()] }
    }

    /// The next depth frame of the leader, or of another one that leads from now on because the leader is silent.
    fn next(&mut self) -> Option<Frame> {
        loop {
            let frame = self.shared.pop()?;
            if frame.depth.is_none() || frame.sensor >= self.last.len() {
                continue;
            }
            self.frames += 1;
            self.last[frame.sensor] = Some(self.frames);
            if !self.is_awake(self.leader) {
                self.leader = frame.sensor;
            }
            if frame.sensor == self.leader {
                return Some(frame);
            }
        }
    }

    /// True where a sensor gave depth of late; nobody sleeps at the beginning.
    fn is_awake(&self, sensor: usize) -> bool {
        self.frames <= QUIET || self.last[sensor].is_some_and(|last| self.frames - last <= QUIET)
    }

    /// The leader alone, for a fuser.
    fn leader_rig(&self) -> Rig {
        Rig { sensors: self.rig.sensors.get(self.leader).cloned().into_iter().collect() }
    }

    /// Where the second of two sensors stands when the first stands there.
    fn pose_of(&self, [first, second]: [usize; 2], scan_from_first: &Rigid) -> Rigid {
        let place = |k: usize| self.rig.sensors[k].rig_from_depth;
        scan_from_first * place(first).inverse() * place(second)
    }

    /// Marks what all sensors that are awake see of the subject.
    fn mark(&self, turn: &mut Turn, scan_from_leader: &Rigid) {
        turn.push(scan_from_leader);
        let others = (0..self.last.len()).filter(|k| *k != self.leader && self.last[*k].is_some() && self.is_awake(*k));
        others.for_each(|k| turn.also_seen_from(&self.pose_of([self.leader, k], scan_from_leader)));
    }
}

/// Looks for somebody who moves, then fuses; starts anew when it is lost, or another sensor leads.
fn follow(rig: &Rig, shared: &Shared, growing: &mut Growing) {
    let settings = FusionSettings { voxel_size: VOXEL, truncation: 4.0 * VOXEL, ..FusionSettings::default() };
    let mut sensors = Sensors::new(rig, shared);
    let mut kept: Vec<Frame> = Vec::new();
    let mut next_look = FIRST_LOOK;
    while let Some(frame) = sensors.next() {
        if kept.last().is_some_and(|last| last.sensor != frame.sensor) {
            kept.clear();
            next_look = FIRST_LOOK;
        }
        kept.push(frame);
        if kept.len() < next_look {
            continue;
        }
        // Nobody moves yet, or too little: look again when there is twice as much.
        next_look = 2 * kept.len();
        let leader = sensors.leader_rig();
        if let Ok(volume) = survey(&leader, &kept, &settings)
            && let Ok(fuser) = LiveFuser::new(&leader, Some(volume), settings.clone())
        {
            kept = fuse(fuser, std::mem::take(&mut kept), &mut sensors, growing);
            next_look = FIRST_LOOK;
        }
        if kept.len() > MAX_KEPT {
            // Every other one shows the same about who moves.
            let mut keep = false;
            kept.retain(|_| {
                keep = !keep;
                keep
            });
            next_look = MAX_KEPT;
        }
    }
}

/// Fuses what was kept and what comes, until there is no more or it is lost. Returns the first frame of another sensor
/// that leads now.
fn fuse(mut fuser: LiveFuser, kept: Vec<Frame>, sensors: &mut Sensors<'_>, growing: &mut Growing) -> Vec<Frame> {
    let (shared, leader) = (sensors.shared, sensors.leader);
    shared.lock().seen.turn.start_anew();
    let (mut lost, mut pose) = (0, None);
    let mut waiting: VecDeque<Frame> = kept.into();
    while let Some(frame) = waiting.pop_front().or_else(|| sensors.next()) {
        if shared.lock().ends {
            break;
        }
        if frame.sensor != leader {
            let from = |pose: &Rigid| sensors.pose_of([leader, frame.sensor], pose);
            pose.iter().for_each(|pose| shared.lock().seen.turn.follow_another(&from(pose)));
            return vec![frame];
        }
        let outcome = fuser.push(&frame);
        let mut state = shared.lock();
        match outcome {
            Ok(Outcome::Fused { model_from_camera: scan_from_camera, .. }) => {
                lost = 0;
                pose = Some(scan_from_camera);
                state.seen.fused += 1;
                sensors.mark(&mut state.seen.turn, &scan_from_camera);
            }
            Ok(Outcome::Dropped { .. }) => {
                lost += 1;
                state.seen.unplaced += 1;
            }
            Err(_) => break,
        }
        drop(state);
        growing.show(&fuser);
        if lost >= LOST {
            break;
        }
    }
    Vec::new()
}

#[cfg(test)]
mod tests {
    use toile_capture::Source;
    use toile_driver_synthetic::SyntheticDevice;
    use toile_synthetic::SyntheticSettings;

    use super::*;

    /// A virtual person who turns by 6° a frame, and wears nothing that would have to be made first.
    fn turning() -> SyntheticDevice {
        let scene =
            SyntheticSettings { frames: 60, degrees: 354.0, seed: 3, garments: Vec::new(), ..Default::default() };
        SyntheticDevice::open(&scene, 0).unwrap()
    }

    /// Frames of the person without colours, which need time.
    fn frames(count: usize) -> (Rig, Vec<Frame>) {
        let mut device = turning();
        let next = |_| device.next_frame().unwrap().map(|f| Frame { color: None, ..f });
        let frames = (0..count).map_while(next).collect();
        (device.rig().clone(), frames)
    }

    #[test]
    fn of_a_live_camera_the_oldest_waiting_frame_makes_room_and_is_counted() {
        let (_, frames) = frames(1);
        let (rig, shared) = (Rig::default(), Arc::new(Shared::default()));
        let preview = Preview { shared: shared.clone(), thread: None, pace: Pace::Live, room: ROOM };
        (0..20).for_each(|index| preview.push(Frame { index, ..frames[0].clone() }));
        let waiting: Vec<u64> = shared.lock().queue.iter().map(|f| f.index).collect();
        assert_eq!((waiting, preview.seen().skipped), ((12..20).collect(), 12));
        drop((preview, rig));
    }

    #[test]
    fn a_subject_that_is_lost_is_looked_for_anew_and_the_turn_goes_on() {
        let (rig, frames) = frames(52);
        let preview = Preview::start(rig, Pace::OnDemand, None).unwrap();
        let see = |range: &[Frame]| range.iter().for_each(|frame| preview.push(frame.clone()));
        see(&frames[..26]);
        // Somebody stands before the camera for fifteen frames.
        let blocked = |frame: &Frame| {
            let mut depth = (**frame.depth.as_ref().unwrap()).clone();
            let width = depth.width as usize;
            depth.values.iter_mut().enumerate().for_each(|(i, v)| *v = 700 + (i % width / 2) as u16);
            Frame { depth: Some(Arc::new(depth)), ..frame.clone() }
        };
        see(&(0..15).map(|_| blocked(&frames[25])).collect::<Vec<_>>());
        see(&frames[26..]);
        let seen = preview.finish();
        assert!(seen.unplaced >= LOST, "{seen:?}");
        // By then the person has turned by 150°. Somebody who moves is looked for among 12 frames, then among 24.
        let angle = seen.turn.angle().to_degrees();
        assert!(seen.fused > 26 && angle > 150.0 + 40.0 && angle < 51.0 * 6.0 + 6.0, "{angle}: {seen:?}");
    }

    #[test]
    fn another_sensor_of_the_rig_takes_over_when_the_first_falls_silent() {
        let (one, frames) = frames(60);
        let mut rig = Rig { sensors: vec![one.sensors[0].clone(), one.sensors[0].clone()] };
        rig.sensors[1].name = "second".into();
        let preview = Preview::start(rig, Pace::OnDemand, None).unwrap();
        // The first is unplugged after twelve frames; the second sees the same.
        for (i, frame) in frames.iter().cycle().take(12 + QUIET as usize + 30).enumerate() {
            if i < 12 {
                preview.push(frame.clone());
            }
            preview.push(Frame { sensor: 1, ..frame.clone() });
        }
        let seen = preview.finish();
        assert!(seen.fused > 12 + 20, "{seen:?}");
    }
}
