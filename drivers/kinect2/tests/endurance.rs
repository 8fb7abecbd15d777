//! Unplugs, long takes, and takes that are recorded again.
#![allow(missing_docs, clippy::unwrap_used)] // helpers of tests are not seen as tests

mod common;

use std::sync::{Arc, Mutex};

use common::{PATTERN, depth_fault, plugged, settings};
use toile_driver_kinect2::{ColorMode, DecodeSettings, Kinect2, Settings};
use toile_driver_simulated::{
    kinect2::{Optics, Pattern, SimulatedCamera, StreamFault},
    trials,
};

#[test]
fn a_recorded_take_replayed_and_recorded_again_is_the_same() {
    let (bus, ..) = plugged(SimulatedCamera::new(PATTERN.clone()));
    let mut kinect = Kinect2::open(&bus, None, Settings { color: ColorMode::Registered, ..settings() }).unwrap();
    trials::recorded_again_is_the_same(tempfile::tempdir().unwrap().path(), &mut kinect, 12);
}

/// A leak of one packet a cycle would be 80 · 3 MB.
#[test]
fn a_hundred_unplugs_and_replugs_end_cleanly_and_nothing_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let settings = Settings { color: ColorMode::Off, ..settings() };
    // A straight lens: nothing to undo a hundred times.
    let pattern = Pattern::of(Optics::of_synthetic_sensor());
    trials::unplugged_a_hundred_times(folder.path(), 120_000, |cycle, bus| {
        let fault = depth_fault(1 + cycle % 2, 17 * cycle as usize % 90, StreamFault::Unplug);
        let model = Arc::new(Mutex::new(SimulatedCamera::new(pattern.clone()).with_faults([fault])));
        bus.plug(model.clone());
        (model, Box::new(Kinect2::open(bus, None, settings.clone()).unwrap()))
    });
}

/// This many frames leave memory as it was; a leak of a tenth of a packet a frame would be 0.3 MB each.
fn memory_stays_flat_over(frames: u64) {
    let (bus, ..) = plugged(SimulatedCamera::new(PATTERN.clone()));
    let decode = DecodeSettings { smooth: false, drop_edges: false, ..DecodeSettings::default() };
    let plain = Settings { color: ColorMode::Off, decode, ..settings() };
    let mut kinect = Kinect2::open(&bus, None, plain).unwrap();
    trials::memory_stays_flat(&mut kinect, frames, 120_000);
}

#[test]
fn a_thousand_frames_leave_memory_flat() {
    memory_stays_flat_over(1000);
}

#[test]
#[ignore = "takes a minute; `make test` runs it"]
fn ten_thousand_frames_leave_memory_flat() {
    memory_stays_flat_over(10_000);
}
