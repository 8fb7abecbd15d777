//! Configuration descriptors of UVC cameras.
#![no_main]

use libfuzzer_sys::fuzz_target;
use toile_driver_transport::simulated::uvc;

fuzz_target!(|bytes: &[u8]| {
    uvc::functions(bytes);
});
