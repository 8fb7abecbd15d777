//! Guidance as values: what an operator should see and hear while the subject stands, turns and is recorded.
//!
//! - `outline`: where the subject is in a depth image, as counts by height and side;
//! - `pose`: arms away from the body;
//! - `exposure`: too dark, too bright;
//! - `sides`: which directions and heights were not seen yet;
//! - `speed`: how fast the turn is, and how fast it may be;
//! - [`Watch`]: all of it, frame by frame.

mod exposure;
mod outline;
mod pose;
mod sides;
mod speed;
mod watch;

pub use exposure::Exposure;
pub use outline::Dropout;
pub use pose::PoseCheck;
pub use sides::{COLUMNS, ROWS, Unseen};
pub use watch::{Guidance, SensorHealth, Watch};
