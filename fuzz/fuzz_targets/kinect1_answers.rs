//! Answers of the Kinect v1 to commands, and its calibration.
#![no_main]

use libfuzzer_sys::fuzz_target;
use toile_driver_kinect1::{Calibration, Registration, protocol};

fuzz_target!(|input: (Vec<u8>, Vec<u8>, Vec<u8>, Vec<u8>)| {
    let (fixed, registration, padding, shift) = &input;
    let _ = protocol::answer(fixed, 0x04, 7);
    if let Ok(calibration) = Calibration::parse(fixed, registration, padding, shift) {
        Registration::new(&calibration).register(&calibration.mm_from_raw());
    }
});
