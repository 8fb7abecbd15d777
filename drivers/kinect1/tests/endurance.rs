//! Unplugs, long takes, and takes that are recorded again.
#![allow(missing_docs)]

mod common;

use std::sync::{Arc, Mutex};

use common::{depth_fault, plugged, settings};
use toile_driver_kinect1::{DepthMode, Kinect1, Settings, VideoMode};
use toile_driver_simulated::{
    kinect1::{Pattern, Repeated, SimulatedCamera, StreamFault},
    trials,
};

#[test]
fn a_recorded_take_replayed_and_recorded_again_is_the_same() {
    let (bus, ..) = plugged(SimulatedCamera::new(Pattern::default()));
    let mut kinect = Kinect1::open(&bus, None, settings()).unwrap();
    trials::recorded_again_is_the_same(tempfile::tempdir().unwrap().path(), &mut kinect, 12);
}

/// A leak of one frame a cycle would be 80 · 1.5 MB.
#[test]
fn a_hundred_unplugs_and_replugs_end_cleanly_and_nothing_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    trials::unplugged_a_hundred_times(folder.path(), 60_000, |cycle, bus| {
        let fault = depth_fault(1 + cycle % 2, 17 * cycle as usize % 242, StreamFault::Unplug);
        let model = Arc::new(Mutex::new(SimulatedCamera::new(Pattern::default()).with_faults([fault])));
        bus.plug(model.clone());
        (model, Box::new(Kinect1::open(bus, None, settings()).unwrap()))
    });
}

/// A leak of a tenth of a picture a frame would be 550 MB.
#[test]
fn ten_thousand_frames_leave_memory_flat() {
    let (bus, ..) = plugged(SimulatedCamera::new(Repeated::new(Pattern::default())));
    let small = Settings { depth: DepthMode::Ten, video: VideoMode::Off, ..settings() };
    let mut kinect = Kinect1::open(&bus, None, small).unwrap();
    trials::memory_stays_flat(&mut kinect, 10_000, 60_000);
}
