//! Picture buffers of a RealSense camera, in layouts that a kernel could announce.
#![no_main]

use libfuzzer_sys::fuzz_target;
use toile_capture::pixels::{self, Rows};
use toile_driver_realsense::infrared_pair;

fuzz_target!(|input: (u8, u8, u16, Vec<u8>)| {
    let (width, height, stride, bytes) = input;
    let rows = Rows { width: width.into(), height: height.into(), stride: stride.into() };
    let _ = (pixels::depth16(&bytes, rows), pixels::yuyv(&bytes, rows), infrared_pair(&bytes, rows));
});
