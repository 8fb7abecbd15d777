//! What all cameras that stream have in common: how they are driven and restarted, and how their frames are numbered.

mod driver;
mod numbering;
mod transfers;

pub use driver::{Progress, Streaming, Streams};
pub use numbering::Numbering;
pub use transfers::next_transfer;
