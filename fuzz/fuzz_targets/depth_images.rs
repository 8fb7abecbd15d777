//! Depth images as folders have them: PNG.
#![no_main]

use libfuzzer_sys::fuzz_target;
use toile_capture::fuzzing;

fuzz_target!(|bytes: &[u8]| fuzzing::depth_png(bytes));
