//! Packets and transfers of the Kinect v2's streams, and what they are made of.
#![no_main]

use libfuzzer_sys::fuzz_target;
use toile_driver_kinect2::{ColorStream, DepthStream, color, protocol};
use toile_driver_transport::PacketStatus;

fuzz_target!(|pieces: Vec<Vec<u8>>| {
    let (mut depth, mut colors) = (DepthStream::default(), ColorStream::default());
    for piece in &pieces {
        let _ = depth.push(PacketStatus::Completed, piece, protocol::DEPTH_PACKET_ROOM);
        let _ = protocol::depth_footer(piece);
        if let Some(image) = colors.push(piece) {
            let _ = color::decode(&image.jpeg);
        }
    }
});
