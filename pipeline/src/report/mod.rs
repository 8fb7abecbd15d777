//! `report.html`: what an operator reads.

pub mod base64;
pub mod contents;
pub mod page;
pub mod pictures;

pub use contents::{Contents, TakeRow, write};
