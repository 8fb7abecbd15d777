//! Answers of the Kinect v2 to commands, and its calibration.
#![no_main]

use libfuzzer_sys::fuzz_target;
use toile_driver_kinect2::{Calibration, protocol};

fuzz_target!(|input: (Vec<u8>, Vec<u8>, Vec<u8>)| {
    let (depth, color, p0) = &input;
    let _ = (protocol::completion(depth, 7), protocol::firmware(depth), protocol::serial(depth));
    let _ = Calibration::parse(depth, color, p0);
});
