//! Lists of times and names that are times, paired.
#![no_main]

use libfuzzer_sys::fuzz_target;
use toile_capture::fuzzing;

fuzz_target!(|input: (Vec<i64>, Vec<i64>, String)| {
    let (mut depth, mut color, name) = input;
    depth.sort_unstable();
    color.sort_unstable();
    fuzzing::pair_by_time(&depth, &color);
    fuzzing::image_name(&name);
});
