//! Isochronous packets of the Kinect v1 to frames, and frames to images.
#![no_main]

use libfuzzer_sys::fuzz_target;
use toile_driver_kinect1::{Assembler, decode, protocol::Stream};
use toile_driver_transport::PacketStatus;

fuzz_target!(|packets: Vec<Vec<u8>>| {
    let (mut depth, mut video) = (Assembler::new(Stream::Depth, 4000), Assembler::new(Stream::Video, 4000));
    for packet in &packets {
        if let Some((_, frame)) = depth.push(PacketStatus::Completed, packet) {
            decode::unpack(frame, 11);
        }
        if let Some((_, frame)) = video.push(PacketStatus::Completed, packet) {
            let _ = decode::demosaic(frame);
        }
    }
});
