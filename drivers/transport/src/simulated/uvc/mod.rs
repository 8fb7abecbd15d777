//! The work of Linux' `uvcvideo` between USB and a video node, pure: descriptors to streams, payloads to pictures.
//!
//! Facts: USB Device Class Definition for Video Devices 1.1 (chapters 2.4.3 and 3), and `uvc_driver.c`, `uvc_video.c`
//! (`uvc_video_decode_start`, `_data`, `_end`, `_meta`) of Linux 6.1. Nothing is believed that a device says of lengths.

mod assembler;
mod descriptors;

pub use assembler::{Assembler, Sent};
pub use descriptors::{Function, PictureSize, StreamFormat, Streaming, functions};
