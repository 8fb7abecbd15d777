//! Recording a take while it is watched: the camera's thread, the recorder, and the live preview, each at its own pace.
//!
//! - [`Device`]: the device asked for, opened as a source of frames; [`RigFile`]: several of them in one file;
//!   [`Color`]: the colour of another camera beside its depth;
//! - [`record()`]: frames go to the file in the order in which they come; none is dropped here;
//! - [`TurnSeen`]: the turn so far, by the preview: a thread that fuses as many frames as it keeps up with;
//! - [`Status`]: how the take stands, several times a second, for whoever shows it.

mod color;
mod device;
mod error;
mod preview;
mod record;
mod rig_file;
mod rig_places;
mod status;
mod stop;
mod together;
mod turn;

pub use color::Color;
pub use device::Device;
pub use error::{DeviceError, LiveError};
pub use preview::TurnSeen;
pub use record::{Recorded, record};
pub use rig_file::RigFile;
pub use rig_places::{SensorPlace, with_places};
pub use status::Status;
pub use stop::{Pace, Stop};
pub use turn::Turn;
