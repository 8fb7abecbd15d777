//! Picture buffers of stereo cameras: JPEG, YUYV, grey.
#![no_main]

use libfuzzer_sys::fuzz_target;
use toile_driver_stereo::decode::{Layout, PixelFormat, picture};

fuzz_target!(|input: (u8, u8, u16, Vec<u8>)| {
    let (width, height, stride, bytes) = input;
    for format in [PixelFormat::Mjpg, PixelFormat::Yuyv, PixelFormat::Grey] {
        let _ = picture(&bytes, Layout { format, width: width.into(), height: height.into(), stride: stride.into() });
    }
});
