//! Models of UVC cameras: what a kernel's video driver binds to.
//!
//! - [`Shape`]: camera parts, streams, formats and sizes, and their descriptors; [`Wire`]: bulk or isochronous;
//! - [`SimulatedCamera`]: requests, probe and commit, payloads of a [`Scene`]; [`Fault`]: what goes wrong, and when.
//!
//! Facts: USB Device Class Definition for Video Devices 1.1, and what Linux' `drivers/media/usb/uvc` asks for.

mod camera;
mod descriptors;
mod probe;
mod sending;

pub use camera::{Scene, SimulatedCamera};
pub use descriptors::{ExtensionShape, FormatShape, FunctionShape, Shape, StreamShape, Wire};

pub use crate::faults::StreamFault;

/// A fault of one of the streams, which are counted from 0 over all camera parts.
pub type Fault = crate::faults::Fault<usize>;

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
