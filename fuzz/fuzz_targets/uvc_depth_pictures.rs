//! Depth buffers of UVC cameras.
#![no_main]

use libfuzzer_sys::fuzz_target;
use toile_driver_uvc_depth::decode::{Layout, depth16};

fuzz_target!(|input: (u8, u8, u16, Vec<u8>)| {
    let (width, height, stride, bytes) = input;
    let _ = depth16(&bytes, Layout { width: width.into(), height: height.into(), stride: stride.into() });
});
