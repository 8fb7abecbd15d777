//! Unplugs, long takes, and takes that are recorded again.
#![allow(missing_docs)]

mod common;

use std::sync::{Arc, Mutex};

use common::{depth_fault, pattern, plugged, settings};
use toile_driver_realsense::{Realsense, Settings, VideoMode};
use toile_driver_simulated::{
    trials,
    uvc::{StreamFault, Wire},
};
use toile_driver_transport::simulated::SimulatedVideo;

#[test]
fn a_recorded_take_replayed_and_recorded_again_is_the_same() {
    let (bus, ..) = plugged(pattern(Wire::Isochronous));
    let mut camera = Realsense::open(&SimulatedVideo::new(bus), None, settings()).unwrap();
    trials::recorded_again_is_the_same(tempfile::tempdir().unwrap().path(), &mut camera, 5);
}

/// A leak of one picture a cycle would be 80 · 0.6 MB.
#[test]
fn a_hundred_unplugs_and_replugs_end_cleanly_and_nothing_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    trials::unplugged_a_hundred_times(folder.path(), 40_000, |cycle, bus| {
        let fault = depth_fault(1 + cycle % 2, 17 * cycle as usize % 38, StreamFault::Unplug);
        let model = Arc::new(Mutex::new(pattern(Wire::Bulk).with_faults([fault])));
        bus.plug(model.clone());
        let camera = Realsense::open(&SimulatedVideo::new(bus.clone()), None, settings()).unwrap();
        (model, Box::new(camera))
    });
}

/// A leak of a tenth of a picture a frame would be 180 MB.
#[test]
fn ten_thousand_frames_leave_memory_flat() {
    let (bus, ..) = plugged(pattern(Wire::Bulk));
    let small = Settings { video: VideoMode::Off, size: (424, 240), ..settings() };
    let mut camera = Realsense::open(&SimulatedVideo::new(bus), None, small).unwrap();
    trials::memory_stays_flat(&mut camera, 10_000, 40_000);
}
