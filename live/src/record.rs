//! Frames to the file in the order they come. The camera has a thread of its own; nothing is dropped on the way.

use std::{
    collections::BTreeMap,
    path::Path,
    sync::{
        atomic::{AtomicBool, Ordering},
        mpsc::{self, Receiver, SyncSender},
    },
    thread,
    time::{Duration, Instant},
};

use toile_capture::{CaptureError, Frame, Recorder, RecorderOptions, Source};

use crate::{
    DeviceError, LiveError,
    preview::{Preview, TurnSeen},
    status::{Counter, Status, disk_left},
    stop::{Pace, Stop},
    surface::Surfaces,
};

/// Frames that may wait for the disk: ten seconds of a Kinect. Only beyond that does the device itself lose frames,
/// which its own numbers show.
const ROOM: usize = 300;
/// How often the line is written, and the disk asked.
const LINE_EVERY: Duration = Duration::from_millis(250);
/// Broken frames in a row that end the take.
const MAX_BROKEN: u32 = 30;

/// The recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    /// Frames in the file.
    pub frames: u64,
    /// Bytes of the file.
    pub bytes: u64,
    /// Frames that the device lost, by its own numbers.
    pub lost: u64,
    /// Frames without depth, or without colour though there is a colour camera.
    pub unpaired: u64,
    /// Frames that came but could not be read.
    pub broken: Vec<String>,
    /// The error that ended the device, where it did not end as it should (unplugged).
    pub failed: Option<String>,
    /// The findings of the preview.
    pub seen: TurnSeen,
}

/// Records from `source` to `path` until `stop`, the source's end, or `interrupted`.
///
/// # Errors
/// [`LiveError`] where the file cannot be written (what is in it then stays readable as `.part`), or no frame came.
pub fn record(
    source: Box<dyn Source>,
    path: &Path,
    how: (Stop, Pace),
    interrupted: &AtomicBool,
    report: &mut dyn FnMut(&Status),
) -> Result<Recorded, LiveError> {
    record_seen(source, path, how, interrupted, None, report)
}

/// The same, with the surface that grows in `surfaces`.
///
/// # Errors
/// As [`record`].
pub fn record_seen(
    mut source: Box<dyn Source>,
    path: &Path,
    (stop, pace): (Stop, Pace),
    interrupted: &AtomicBool,
    surfaces: Option<Surfaces>,
    report: &mut dyn FnMut(&Status),
) -> Result<Recorded, LiveError> {
    let recorder = Recorder::create(path, source.rig(), RecorderOptions::default())?;
    let preview = Preview::start(source.rig().clone(), pace, surfaces).map_err(|e| CaptureError::io(path, e))?;
    let has_color = source.rig().sensors.iter().any(|s| s.color.is_some());
    let ends = AtomicBool::new(false);
    let (sender, frames) = mpsc::sync_channel(if pace == Pace::Live { ROOM } else { 2 });
    thread::scope(|scope| {
        let camera = thread::Builder::new().name("camera".into());
        let ends = &ends;
        camera
            .spawn_scoped(scope, move || run_camera(&mut *source, &sender, ends))
            .map_err(|e| CaptureError::io(path, e))?;
        let mut take =
            Recording { recorder, preview, stop, counter: Counter::default(), has_color, times_ns: BTreeMap::new() };
        let ended = take.follow(&frames, path, interrupted, report);
        // Also after an error the camera must not wait for anybody.
        ends.store(true, Ordering::Release);
        while frames.recv().is_ok() {}
        take.finish(ended?)
    })
}

/// Asks the source for frames until it ends, or until it is asked to stop.
fn run_camera(source: &mut dyn Source, sender: &SyncSender<Result<Frame, CaptureError>>, ends: &AtomicBool) {
    while !ends.load(Ordering::Acquire) {
        let next = match source.next_frame() {
            Ok(None) => return,
            Ok(Some(frame)) => Ok(frame),
            Err(error) => Err(error),
        };
        if sender.send(next).is_err() {
            return;
        }
    }
}

struct Recording {
    recorder: Recorder,
    preview: Preview,
    stop: Stop,
    counter: Counter,
    has_color: bool,
    /// Device time of the first and the last frame of each sensor: their clocks differ.
    times_ns: BTreeMap<usize, (i64, i64)>,
}

/// How the frames ended.
#[derive(Default)]
struct Ended {
    broken: Vec<String>,
    failed: Option<String>,
}

impl Recording {
    /// Writes frames until it is time to stop.
    fn follow(
        &mut self,
        frames: &Receiver<Result<Frame, CaptureError>>,
        path: &Path,
        interrupted: &AtomicBool,
        report: &mut dyn FnMut(&Status),
    ) -> Result<Ended, LiveError> {
        let (mut ended, mut said, mut in_a_row) = (Ended::default(), None, 0);
        while !interrupted.load(Ordering::Acquire) {
            match frames.recv_timeout(LINE_EVERY) {
                Ok(Ok(frame)) => {
                    in_a_row = 0;
                    self.write(frame)?;
                }
                Ok(Err(CaptureError::Device { device, reason })) => {
                    let before = ended.failed.take().map_or(String::new(), |before| before + "; ");
                    ended.failed = Some(format!("{before}{device}: {reason}"));
                }
                Ok(Err(error)) => {
                    in_a_row += 1;
                    ended.broken.push(error.to_string());
                    if in_a_row >= MAX_BROKEN {
                        return Ok(ended);
                    }
                }
                Err(mpsc::RecvTimeoutError::Timeout) => {}
                Err(mpsc::RecvTimeoutError::Disconnected) => return Ok(ended),
            }
            let seen = self.preview.seen();
            if said.is_none_or(|then: Instant| then.elapsed() >= LINE_EVERY) {
                said = Some(Instant::now());
                report(&self.status(path, &seen));
            }
            if self.share(&seen) >= 1.0 {
                return Ok(ended);
            }
        }
        Ok(ended)
    }

    fn status(&self, path: &Path, seen: &TurnSeen) -> Status {
        let [frames_per_second, megabytes_per_second] = self.counter.rates();
        Status {
            frames: self.counter.frames,
            lost: self.counter.lost,
            frames_per_second,
            megabytes_per_second,
            disk_left: disk_left(path),
            seen: seen.clone(),
            stop: self.stop,
            share: self.share(seen),
        }
    }

    fn write(&mut self, frame: Frame) -> Result<(), LiveError> {
        self.recorder.write(&frame)?;
        let bytes = std::fs::metadata(self.recorder.part_path()).map_or(0, |about| about.len());
        self.counter.push(&frame, self.has_color, bytes, Instant::now());
        let now = frame.device_time_ns;
        self.times_ns.entry(frame.sensor).or_insert((now, now)).1 = now;
        self.preview.push(frame);
        Ok(())
    }

    /// How much of the take is done; 1 when it is time to stop.
    fn share(&self, seen: &TurnSeen) -> f64 {
        match self.stop {
            Stop::After(seconds) => {
                let passed = self.times_ns.values().map(|(first, last)| last.saturating_sub(*first) as f64 * 1e-9);
                let passed = passed.fold(0.0, f64::max);
                (passed / seconds.max(1e-9)).min(1.0)
            }
            Stop::AfterOneTurn if seen.turn.is_full() => 1.0,
            Stop::AfterOneTurn => (seen.turn.angle() / std::f64::consts::TAU).min(0.99),
        }
    }

    fn finish(self, ended: Ended) -> Result<Recorded, LiveError> {
        if self.counter.frames == 0 {
            let why = ended.failed.or(ended.broken.into_iter().next()).unwrap_or("the camera sent no frame".into());
            let part = self.recorder.part_path().to_path_buf();
            drop(self.recorder);
            drop(std::fs::remove_file(part));
            return Err(DeviceError::NoFrames(why).into());
        }
        let summary = self.recorder.finish()?;
        let seen = self.preview.finish();
        let Counter { lost, unpaired, .. } = self.counter;
        let Ended { broken, failed } = ended;
        Ok(Recorded { frames: summary.frames, bytes: summary.bytes, lost, unpaired, broken, failed, seen })
    }
}
