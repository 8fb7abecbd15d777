//! The stages, each a step: what it reads and writes, what decides its result, and the one call into the stage's crate.

pub mod cut;
pub mod export;
pub mod fit;
pub mod fuse;
pub mod page;
pub mod pose;
pub mod read_scan;
pub mod stack;
pub mod texture;
