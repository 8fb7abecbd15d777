//! Models of UVC cameras: what a kernel's video driver binds to.
//!
//! - [`Shape`]: camera parts, streams, formats and sizes, and their descriptors; [`Wire`]: bulk or isochronous;
//! - [`UvcModel`]: requests, probe and commit, payloads of a [`Scene`]; [`Fault`]: what goes wrong, and when.
//!
//! Facts: USB Device Class Definition for Video Devices 1.1, and what Linux' `drivers/media/usb/uvc` asks for.

mod camera;
mod descriptors;
mod faults;
mod probe;
mod sending;

pub use camera::{Scene, UvcModel};
pub use descriptors::{ExtensionShape, FormatShape, FunctionShape, Shape, StreamShape, Wire};
pub use faults::{Fault, StreamFault};

/// A stream's picture: which it is and how large.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Picture {
    /// Number of the stream, from 0 over all camera parts.
    pub stream: usize,
    /// Position of its format among the stream's.
    pub format: usize,
    /// Columns and rows.
    pub size: (u16, u16),
    /// Frames a second.
    pub fps: u32,
    /// Number of the frame since the camera was opened.
    pub frame: u64,
}
