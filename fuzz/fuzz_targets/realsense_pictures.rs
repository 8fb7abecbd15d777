//! Picture buffers of a RealSense camera, in layouts that a kernel could tell.
#![no_main]

use libfuzzer_sys::fuzz_target;
use toile_driver_realsense::decode;
use toile_driver_transport::video::{FourCc, PictureLayout};

fuzz_target!(|input: (u8, u8, u16, Vec<u8>)| {
    let (width, height, stride, bytes) = input;
    let layout = PictureLayout { format: FourCc::Z16, width: width.into(), height: height.into(), stride: stride.into() };
    let _ = (decode::depth(&bytes, layout), decode::color(&bytes, layout), decode::infrared_pair(&bytes, layout));
});
