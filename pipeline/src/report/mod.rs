//! `report.html`: what an operator reads.

mod base64;
mod contents;
mod page;
mod pictures;

pub use contents::{Contents, Figures, write};
