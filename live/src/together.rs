//! Several sources as one: their sensors stand in one rig, their frames come as they arrive.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
        mpsc::{self, Receiver, SyncSender},
    },
    thread::JoinHandle,
};

use toile_capture::{CaptureError, Frame, Rig, Source};
use toile_geometry::Rigid;

use crate::stop::Pace;

/// Frames of one source that may wait for the others to be taken.
const ROOM: usize = 30;

/// Sources that record together.
///
/// Each keeps its own clock and frame numbers. One that fails is reported once, and the others go on; the end is when all
/// have ended.
pub struct Together {
    rig: Rig,
    frames: Frames,
    next_index: u64,
}

enum Frames {
    /// Cameras, each with a thread of its own: a slow one holds up no other.
    Live {
        receiver: Option<Receiver<Result<Frame, CaptureError>>>,
        stop: Arc<AtomicBool>,
        threads: Vec<JoinHandle<()>>,
    },
    /// Recordings in the order of host time: the same every time.
    OnDemand(Vec<Waiting>),
}

struct Waiting {
    source: Box<dyn Source>,
    first_sensor: usize,
    next: Option<Frame>,
    ended: bool,
}

/// A source, the name of its (first) sensor, and where it stands.
pub type Placed = (Box<dyn Source>, Option<String>, Rigid);

impl Together {
    /// Joins sources; live ones begin to be read at once.
    ///
    /// # Errors
    /// A sentence where two sensors have one name, or no thread can be had.
    pub fn new(sources: Vec<Placed>, pace: Pace) -> Result<Self, String> {
        let mut rig = Rig::default();
        let mut joined = Vec::new();
        for (source, name, rig_from_depth) in sources {
            let first_sensor = rig.sensors.len();
            for (i, mut sensor) in source.rig().sensors.iter().cloned().enumerate() {
                if let (0, Some(name)) = (i, &name) {
                    sensor.name.clone_from(name);
                }
                if rig.sensors.iter().any(|other| other.name == sensor.name) {
                    return Err(format!("two sensors are called {}; give one another `name`", sensor.name));
                }
                sensor.rig_from_depth = rig_from_depth * sensor.rig_from_depth;
                rig.sensors.push(sensor);
            }
            joined.push(Waiting { source, first_sensor, next: None, ended: false });
        }
        let frames = if pace == Pace::Live { live(joined)? } else { Frames::OnDemand(joined) };
        Ok(Self { rig, frames, next_index: 0 })
    }
}

fn live(sources: Vec<Waiting>) -> Result<Frames, String> {
    let (sender, receiver) = mpsc::sync_channel(ROOM * sources.len());
    let stop = Arc::new(AtomicBool::new(false));
    let spawn = |mut waiting: Waiting| {
        let (sender, stop) = (sender.clone(), stop.clone());
        let named = std::thread::Builder::new().name(format!("sensor {}", waiting.first_sensor));
        named.spawn(move || run(&mut waiting, &sender, &stop)).map_err(|e| e.to_string())
    };
    let threads = sources.into_iter().map(spawn).collect::<Result<_, _>>()?;
    Ok(Frames::Live { receiver: Some(receiver), stop, threads })
}

fn run(waiting: &mut Waiting, sender: &SyncSender<Result<Frame, CaptureError>>, stop: &AtomicBool) {
    while !stop.load(Ordering::Acquire) {
        let Some(next) = waiting.pull().transpose() else { return };
        if sender.send(next).is_err() {
            return;
        }
    }
}

impl Waiting {
    /// The source's next frame, with its sensor's place in the rig.
    fn pull(&mut self) -> Result<Option<Frame>, CaptureError> {
        let first = self.first_sensor;
        Ok(self.source.next_frame()?.map(|frame| Frame { sensor: first + frame.sensor, ..frame }))
    }
}

/// The earliest frame of all sources.
fn earliest(sources: &mut [Waiting]) -> Result<Option<Frame>, CaptureError> {
    for waiting in sources.iter_mut().filter(|w| w.next.is_none() && !w.ended) {
        waiting.next = waiting.pull()?;
        waiting.ended = waiting.next.is_none();
    }
    let time = |w: &Waiting| w.next.as_ref().map_or(i64::MAX, |frame| frame.host_time_ns);
    Ok(sources.iter_mut().min_by_key(|w| time(w)).and_then(|w| w.next.take()))
}

impl Source for Together {
    fn rig(&self) -> &Rig {
        &self.rig
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, CaptureError> {
        let next = match &mut self.frames {
            Frames::OnDemand(sources) => earliest(sources)?,
            // When all threads have ended nothing is left to receive.
            Frames::Live { receiver, .. } => receiver.as_ref().and_then(|r| r.recv().ok()).transpose()?,
        };
        Ok(next.map(|frame| {
            let index = self.next_index;
            self.next_index += 1;
            Frame { index, ..frame }
        }))
    }

    fn frame_count(&self) -> Option<u64> {
        match &self.frames {
            Frames::OnDemand(sources) => sources.iter().map(|w| w.source.frame_count()).sum(),
            Frames::Live { .. } => None,
        }
    }
}

impl Drop for Together {
    fn drop(&mut self) {
        let Frames::Live { receiver, stop, threads } = &mut self.frames else { return };
        stop.store(true, Ordering::Release);
        // Threads that wait for room see that nobody listens.
        *receiver = None;
        threads.drain(..).for_each(|thread| drop(thread.join()));
    }
}

#[cfg(test)]
mod tests {
    use toile_capture::{DepthImage, DeviceIdentity, Sensor};
    use toile_geometry::camera::PinholeCamera;

    use super::*;

    /// Frames at these times, then an error or the end.
    struct Script(Rig, Vec<i64>, bool);

    impl Source for Script {
        fn rig(&self) -> &Rig {
            &self.0
        }
        fn next_frame(&mut self) -> Result<Option<Frame>, CaptureError> {
            if self.1.is_empty() {
                let failed =
                    CaptureError::Device { device: self.0.sensors[0].name.clone(), reason: "unplugged".into() };
                return if std::mem::take(&mut self.2) { Err(failed) } else { Ok(None) };
            }
            let time = self.1.remove(0);
            let depth = DepthImage { width: 1, height: 1, values: vec![1] };
            Ok(Some(Frame {
                sensor: 0,
                index: 0,
                device_frame: time as u64,
                lost_before: 0,
                device_time_ns: 7 * time,
                host_time_ns: time,
                depth: Some(depth.into()),
                color: None,
            }))
        }
    }

    fn script(name: &str, times: &[i64], fails: bool) -> Box<dyn Source> {
        let sensor = Sensor {
            name: name.into(),
            identity: DeviceIdentity::default(),
            depth: PinholeCamera::ideal(1, 1, 1.0, 1.0, 0.0, 0.0),
            depth_scale: 0.001,
            color: None,
            color_from_depth: Rigid::identity(),
            rig_from_depth: Rigid::identity(),
            fps: 30.0,
        };
        Box::new(Script(Rig { sensors: vec![sensor] }, times.to_vec(), fails))
    }

    fn together(pace: Pace, fails: bool) -> Together {
        let left = (script("kinect", &[0, 30, 60], fails), Some("left".into()), Rigid::identity());
        let right = (script("kinect", &[10, 20, 70, 80], false), None, Rigid::translation(1.0, 0.0, 0.0));
        Together::new(vec![left, right], pace).unwrap()
    }

    #[test]
    fn recordings_are_merged_in_the_order_of_host_time() {
        let mut both = together(Pace::OnDemand, false);
        let reported: Vec<_> =
            std::iter::from_fn(|| both.next_frame().unwrap()).map(|f| (f.index, f.sensor, f.host_time_ns)).collect();
        assert_eq!(reported, [(0, 0, 0), (1, 1, 10), (2, 1, 20), (3, 0, 30), (4, 0, 60), (5, 1, 70), (6, 1, 80)]);
        let names: Vec<_> =
            both.rig().sensors.iter().map(|s| (s.name.as_str(), s.rig_from_depth.translation.x)).collect();
        assert_eq!(names, [("left", 0.0), ("kinect", 1.0)]);
    }

    #[test]
    fn of_cameras_one_that_fails_is_reported_and_the_other_goes_on() {
        let mut both = together(Pace::Live, true);
        let (mut frames, mut errors) = ([0, 0], 0);
        loop {
            match both.next_frame() {
                Ok(Some(frame)) => frames[frame.sensor] += 1,
                Ok(None) => break,
                Err(_) => errors += 1,
            }
        }
        assert_eq!((frames, errors), ([3, 4], 1));
        // Left while cameras wait for room.
        drop(together(Pace::Live, false));
    }

    #[test]
    fn two_sensors_of_one_name_are_refused() {
        let sources = [(); 2].map(|()| (script("kinect", &[], false), None, Rigid::identity()));
        assert!(Together::new(sources.into(), Pace::OnDemand).err().unwrap().contains("kinect"));
    }
}
