//! Messages, pictures and archives of other programs' recordings: ROS, .sens, ZIP, LZFSE, PGM.
#![no_main]

use libfuzzer_sys::fuzz_target;
use toile_capture::fuzzing;

fuzz_target!(|bytes: &[u8]| fuzzing::recording(bytes));
