//! Depth cameras that speak UVC (Z16, Y16) through video nodes.
//!
//! - [`nodes`]: which nodes offer depth;
//! - `calibration`: the intrinsics file that such cameras need, since UVC does not carry any;
//! - `stream`, `numbering`: buffers to numbered frames;
//! - [`UvcDepthCamera`]: the [`toile_capture::Source`] over it all.

mod calibration;
mod device;
mod error;
pub mod nodes;
mod numbering;
mod settings;
mod stream;

pub use device::UvcDepthCamera;
pub use error::UvcDepthError;
pub use settings::{Health, Settings};
