//! A take: frames pushed one by one, all at once, or while they are recorded.

mod fuse;
mod fuser;
mod live;
mod model;
mod preparer;
mod survey;
mod waiting;

pub(crate) use preparer::Preparer;
pub(crate) use survey::survey_sensor;
pub(crate) use waiting::{Waiting, spread};

pub use fuse::fuse;
pub use fuser::{Fuser, Outcome};
pub use live::LiveFuser;
pub(crate) use model::NOISE_BAND;
pub use survey::survey;
