//! Recording a take while it is watched: the camera's thread, the recorder, and the live preview, each at its own pace.
//!
//! - [`Device`]: the device asked for, opened as a source of frames; [`RigFile`]: several of them in one file;
//!   [`Color`]: the colour of another camera beside its depth;
//! - [`record()`]: frames go to the file in the order in which they come; none is dropped here;
//! - [`TurnSeen`]: the turn so far, by the preview: a thread that fuses as many frames as it keeps up with;
//! - [`Watch`]: guidance as values, from the frames themselves; [`Practice`]: the virtual person as a camera that does not wait;
//! - [`Status`]: how the take stands, several times a second, for whoever shows it.

mod color;
mod colors;
mod device;
mod error;
pub mod guidance;
mod listing;
mod practice;
mod preview;
mod record;
mod rig_file;
mod rig_places;
mod status;
mod stop;
mod surface;
mod together;
mod turn;

pub use color::Color;
pub use colors::{DepthColors, depth_colors};
pub use device::Device;
pub use error::{DeviceError, LiveError};
pub use guidance::{Guidance, Watch};
pub use listing::{FoundDevice, Listing, missing_nodes};
pub use practice::Practice;
pub use preview::TurnSeen;
pub use record::{Recorded, record, record_seen};
pub use rig_file::RigFile;
pub use rig_places::{SensorPlace, with_places};
pub use status::{Status, disk_left};
pub use stop::{Pace, Stop};
pub use surface::{Surface, Surfaces};
pub use turn::Turn;
