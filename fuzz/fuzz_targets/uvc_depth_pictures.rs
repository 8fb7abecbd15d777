//! Depth buffers of UVC cameras.
#![no_main]

use libfuzzer_sys::fuzz_target;
use toile_capture::pixels::{Rows, depth16, grey};

fuzz_target!(|input: (u8, u8, u16, Vec<u8>)| {
    let (width, height, stride, bytes) = input;
    let rows = Rows { width: width.into(), height: height.into(), stride: stride.into() };
    let _ = (depth16(&bytes, rows), grey(&bytes, rows));
});
