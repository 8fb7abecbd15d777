//! The stages on disk: from recorded takes to a dressed avatar and its report.
//!
//! No algorithm lives here, and nothing of a command line. The stages' crates take values and return values; this crate
//! reads what they need from a subject's folder, hands it over, and writes what they give back, whole or not at all:
//!
//! - [`process()`]: all stages in their order, up to a [`Goal`];
//! - [`steps`]: the stages, each a file with what it reads and writes and the one call into the stage's crate;
//! - [`stage`]: a stage is skipped when its inputs, settings and version are what its record says;
//! - [`Run`]: one run over one subject; [`Folders`]: where its files lie;
//! - [`report`]: the page that an operator reads;
//! - [`Observer`]: who is told how far a run is.
//!
//! A run can stop anywhere and go on later with the same result.

pub mod body_file;
pub mod disk;
mod error;
mod folders;
mod garment;
mod hash;
mod memory;
mod motion;
mod observer;
mod opened;
mod options;
mod process;
pub mod report;
mod rigged_scan;
mod run;
mod skin_attributes;
pub mod stage;
pub mod steps;
mod summary;

pub use error::PipelineError;
pub use folders::Folders;
pub use observer::{Observer, Silent};
pub use opened::Opened;
pub use options::{Goal, Options};
pub use process::process;
pub use run::Run;
pub use summary::Summary;
