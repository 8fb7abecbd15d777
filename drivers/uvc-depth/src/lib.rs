//! Depth cameras that speak UVC (Z16, Y16) through V4L2.
//!
//! - [`decode`]: buffer bytes to a depth image, pure;
//! - [`calibration`]: the intrinsics file that such cameras need, since UVC does not carry any;
//! - [`stream`]: buffers from a V4L2 node (or from anything else that yields buffers);
//! - [`device`]: the [`toile_capture::Source`] over it all.

pub mod calibration;
pub mod decode;
pub mod device;
pub mod error;
pub mod stream;

pub use device::UvcDepthCamera;
pub use error::UvcDepthError;
