//! Depth cameras that speak UVC (Z16, Y16) through video nodes.
//!
//! - [`nodes`]: which nodes offer depth;
//! - [`decode`]: buffer bytes to a depth image, pure;
//! - [`calibration`]: the intrinsics file that such cameras need, since UVC does not carry any;
//! - [`device`]: the [`toile_capture::Source`] over it all.

pub mod calibration;
pub mod decode;
pub mod device;
pub mod error;
pub mod nodes;
mod numbering;

pub use device::{Health, Settings, UvcDepthCamera};
pub use error::UvcDepthError;
