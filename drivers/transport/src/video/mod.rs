//! Video nodes: what a program sees of cameras that a kernel driver serves (V4L2 over UVC).
//!
//! - [`Video`] lists and opens nodes; [`VideoNode`] is an open one: formats, buffers with a time limit, controls and the
//!   UVC extension units of its camera; metadata nodes are nodes too;
//! - [`kernel::KernelVideo`]: both over V4L2 (through `v4l`); `sysfs`: which USB device a node belongs to;
//!   [`crate::simulated::SimulatedVideo`]: both in this process.

mod format;
pub mod kernel;
mod mapped;
mod node;
mod sysfs;

pub use format::{FourCc, PictureLayout};
pub use node::{NodeInfo, UsbPlace, Video, VideoBuffer, VideoNode};
