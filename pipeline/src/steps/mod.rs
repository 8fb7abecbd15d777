//! The stages, each a file: what it reads, what it writes, and the one call into the stage's crate.

pub mod cut;
pub mod export;
pub mod fit;
pub mod fuse;
pub mod pose;
pub mod report;
pub mod stack;
