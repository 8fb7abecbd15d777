//! From the frames of a take to its scan.

mod clean_up;
mod closing;
mod fuse_again;
mod noise;
mod noisy;
mod pairs;
mod placing;
mod poses;
mod residuals;
mod scale;
mod summary;
mod whole;

#[cfg(test)]
pub(crate) use {closing::close, whole::minimum_weight};

pub(crate) use pairs::{Node, apply, linearise, solve};
pub(crate) use poses::settle_poses;
pub use whole::finish;
