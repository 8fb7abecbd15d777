//! The `toile` program: command line, pipeline, reports.
//!
//! No algorithm lives here. The stages' crates take values and return values; this crate reads what they need from a
//! subject's folder, hands it over, and writes what they give back, whole or not at all:
//!
//! - [`cli`], [`commands`]: what can be asked;
//! - [`pipeline`]: the stages in their order, each a file with what it reads and writes;
//! - [`capture`](mod@capture): recording from a camera;
//! - [`stage`]: a stage is skipped when its inputs, settings and version are what its record says;
//! - [`report`]: the page that an operator reads;
//! - [`outcome`]: how a command ended; `main` alone turns that into an exit code.
//!
//! ```
//! use toile_studio::{Outcome, run};
//! let words = ["toile", "--version"].map(Into::into);
//! assert_eq!(run(words), Outcome::Done);
//! ```

pub mod capture;
pub mod cli;
pub mod commands;
pub mod disk;
pub mod error;
pub mod hash;
pub mod memory;
pub mod outcome;
pub mod pipeline;
pub mod progress;
pub mod report;
pub mod run;
pub mod stage;

pub use error::StudioError;
pub use outcome::Outcome;
pub use progress::Progress;
pub use run::run;
