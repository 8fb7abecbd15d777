//! Answers of a RealSense camera's firmware.
#![no_main]

use libfuzzer_sys::fuzz_target;
use toile_driver_realsense::monitor;

fuzz_target!(|bytes: &[u8]| {
    for code in [0x10, 0x15] {
        if let Ok(data) = monitor::answer(code, bytes) {
            let _ = monitor::details(data);
        }
    }
});
