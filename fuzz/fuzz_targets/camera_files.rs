//! Calibration files: `camera.json` and OpenCV's XML.
#![no_main]

use libfuzzer_sys::fuzz_target;
use toile_capture::fuzzing;

fuzz_target!(|text: &str| fuzzing::camera_file(text));
