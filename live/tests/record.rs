//! Takes from cameras made of code: unplugged, silent, too fast to be looked at.

#![allow(missing_docs, clippy::unwrap_used)]

use std::{
    fs,
    path::Path,
    sync::{Arc, Mutex, atomic::AtomicBool},
    time::Duration,
};

use toile_capture::{CaptureError, Frame, Replay, Rig, Source};
use toile_driver_kinect1::{Kinect1, Settings};
use toile_driver_simulated::kinect1::{Fault, Pattern, SimulatedCamera, Stream, StreamFault};
use toile_driver_transport::simulated::SimulatedBus;
use toile_live::{LiveError, Pace, Recorded, Stop, record};

fn frames(path: &Path) -> Vec<Frame> {
    let replay = Replay::open(path).unwrap();
    assert!(replay.lost().is_none());
    (0..replay.len()).map(|i| replay.frame(i).unwrap()).collect()
}

fn kinect(faults: Vec<Fault>) -> Box<dyn Source> {
    let bus = SimulatedBus::default();
    bus.plug(Arc::new(Mutex::new(SimulatedCamera::new(Pattern::default()).with_faults(faults))));
    Box::new(Kinect1::open(&bus, None, Settings::default()).unwrap())
}

/// Records a live camera, and listens to nothing.
fn recorded(source: Box<dyn Source>, path: &Path, stop: Stop) -> Result<Recorded, LiveError> {
    record(source, path, (stop, Pace::Live), &AtomicBool::new(false), &mut |_| {})
}

#[test]
fn an_unplug_ends_the_take_with_every_frame_that_came() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("take.mcap");
    let unplug = Fault { stream: Stream::Depth, frame: 12, packet: 60, what: StreamFault::Unplug };
    let lost = Fault { stream: Stream::Depth, frame: 4, packet: 60, what: StreamFault::Lost(2) };
    let recorded = recorded(kinect(vec![lost, unplug]), &path, Stop::AfterOneTurn).unwrap();
    let frames = frames(&path);
    assert!(recorded.failed.unwrap().contains("unplugged"));
    assert_eq!((recorded.frames, frames.len() as u64), (12, 12));
    assert_eq!((recorded.lost, recorded.unpaired), (0, 1));
    assert!(frames.iter().zip(0..).all(|(f, k)| f.device_frame == k));
}

#[test]
fn a_camera_that_is_plugged_in_again_records_the_next_take() {
    let dir = tempfile::tempdir().unwrap();
    let bus = SimulatedBus::default();
    let take = |name: &String, faults: Vec<Fault>| {
        let model = SimulatedCamera::new(Pattern::default()).with_faults(faults);
        let info = bus.plug(Arc::new(Mutex::new(model)));
        let limit = Duration::from_secs(1);
        toile_driver_transport::wait_for(&bus, |info| info.product == 0x02ae, limit).unwrap();
        let kinect = Box::new(Kinect1::open(&bus, None, Settings::default()).unwrap());
        let recorded = recorded(kinect, &dir.path().join(name), Stop::After(0.5)).unwrap();
        bus.unplug(&info);
        recorded
    };
    for round in 0..3 {
        let unplug = Fault { stream: Stream::Depth, frame: 5 + round, packet: 9, what: StreamFault::Unplug };
        let names = ["torn", "whole"].map(|name| format!("{name}{round}.mcap"));
        let torn = take(&names[0], vec![unplug]);
        assert!(torn.failed.is_some() && torn.frames >= 5 + round);
        // The first model took itself off the bus; the next one is another device to it.
        let whole = take(&names[1], Vec::new());
        assert!(whole.failed.is_none() && whole.lost == 0, "{whole:?}");
        let frames = [torn.frames, whole.frames];
        assert_eq!(names.map(|name| self::frames(&dir.path().join(name)).len() as u64), frames);
        assert!(whole.frames >= 15);
    }
}

#[test]
fn a_camera_that_gives_nothing_leaves_no_file() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("take.mcap");
    let unplug = Fault { stream: Stream::Depth, frame: 0, packet: 0, what: StreamFault::Unplug };
    let error = recorded(kinect(vec![unplug]), &path, Stop::AfterOneTurn).unwrap_err();
    assert!(error.to_string().contains("unplugged"));
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
}

/// Gives the same frame as fast as it is asked for.
struct Fast {
    frame: Frame,
    rig: Rig,
    left: u64,
}

impl Source for Fast {
    fn rig(&self) -> &Rig {
        &self.rig
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, CaptureError> {
        self.left = self.left.saturating_sub(1);
        self.frame.device_frame += 1;
        self.frame.color = None;
        Ok((self.left > 0).then(|| self.frame.clone()))
    }
}

#[test]
fn what_the_preview_cannot_keep_up_with_is_recorded_all_the_same() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("take.mcap");
    let mut camera = kinect(Vec::new());
    let (rig, frame) = (camera.rig().clone(), camera.next_frame().unwrap().unwrap());
    let source = Box::new(Fast { frame, rig, left: 151 });
    let recorded = recorded(source, &path, Stop::AfterOneTurn).unwrap();
    assert_eq!((recorded.frames, Replay::open(&path).unwrap().len()), (150, 150));
    assert!(recorded.seen.fused + recorded.seen.unplaced + recorded.seen.skipped <= 150);
}
