//! `subject.toml` and `pending.toml`.
#![no_main]

use libfuzzer_sys::fuzz_target;
use toile_capture::fuzzing;

fuzz_target!(|text: &str| fuzzing::subject(text));
