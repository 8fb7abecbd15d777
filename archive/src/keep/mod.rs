//! Keeping archives: checking, packing, unpacking and forgetting.

mod check;
mod files;
mod forget;
mod pack;
mod tombstone;
mod unpack;

pub use check::{Checked, check};
#[cfg(feature = "cloud")]
pub(crate) use files::{inside, list};
pub use forget::{Forgotten, forget};
pub use pack::{Packed, pack};
pub(crate) use tombstone::forgotten;
pub use unpack::{Unpacked, unpack};
