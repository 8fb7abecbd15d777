//! Metadata buffers of a RealSense camera.
#![no_main]

use libfuzzer_sys::fuzz_target;
use toile_driver_realsense::metadata;

fuzz_target!(|bytes: &[u8]| {
    metadata::parse(bytes, true);
    metadata::parse(bytes, false);
});
