//! Packed depth of recordings.
#![no_main]

use libfuzzer_sys::fuzz_target;
use toile_capture::depth_codec;

fuzz_target!(|bytes: &[u8]| {
    let _ = depth_codec::decode(bytes);
});
