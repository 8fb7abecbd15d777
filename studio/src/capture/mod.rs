//! Recording a take: the camera's thread, the recorder, and the live preview, each at its own pace.
//!
//! - [`device`]: what was asked for, opened as a source of frames;
//! - [`rig_file`]: several of them in one file; [`together`]: their frames as those of one source;
//! - [`record`](mod@record): frames go to the file in the order they come; none is dropped here;
//! - [`preview`]: a thread that fuses what it can keep up with; its queue drops the oldest;
//! - [`turn`]: how far the subject has turned, and which sides were not seen yet;
//! - [`status`]: the live line.

pub mod device;
pub mod preview;
pub mod record;
pub mod rig_file;
pub mod status;
pub mod together;
pub mod turn;

pub use device::{Device, Pace};
pub use record::{Recorded, Stop, record};
pub use rig_file::RigFile;
