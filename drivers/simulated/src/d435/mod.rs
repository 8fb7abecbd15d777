//! The RealSense D435: depth and the infrared pair in one camera part, colour in the other.
//!
//! - [`model`]: the camera as a [`SimulatedCamera`](crate::uvc::SimulatedCamera), [`d405`]: its kin without colour; [`D435`]: its scene, [`Content`] what it sees;
//! - [`Optics`]: what it is calibrated to, and the tables that say so; [`MonitorFault`]: firmware that answers nonsense.
//!
//! Facts: librealsense (`src/ds/ds-private.h`, `src/ds/d400/d400-private.h`, `src/hw-monitor.cpp`,
//! `src/platform/uvc-option.cpp`, `src/metadata.h`) and `lsusb -v` of a D435.

mod content;
mod monitor;
mod optics;
mod scene;

pub use content::{Content, Pattern, Rendered};
pub use monitor::{Monitor, MonitorFault};
pub use optics::Optics;
pub use scene::{COLOR, D435, DEPTH, INFRARED, d405, model};
