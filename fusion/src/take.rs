//! A take: frames pushed one by one, all at once, or while they are recorded.

mod fuse;
mod fuser;
mod live;
mod model;
mod preparer;

pub use fuse::{fuse, survey};
pub use fuser::{Fuser, Outcome};
pub use live::LiveFuser;
pub(crate) use model::NOISE_BAND;
