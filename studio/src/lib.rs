//! The `toile` program: a command line over the stages and the cameras.
//!
//! No algorithm lives here. [`toile_pipeline`] takes a subject's folder from recordings to an avatar; [`toile_live`]
//! records; this crate says what can be asked, asks it, and prints the answer:
//!
//! - `cli`, `commands`: the commands and their options;
//! - `run`: one run of the program, words in, answer out;
//! - [`Outcome`]: how a command ended; `main` alone turns that into an exit code.
//!
//! ```
//! use toile_studio::{Outcome, run};
//! let words = ["toile", "--version"].map(Into::into);
//! assert_eq!(run(words), Outcome::Done);
//! ```

mod cli;
mod commands;
mod error;
mod outcome;
mod progress;
mod run;
mod session;

pub use error::StudioError;
pub use outcome::Outcome;
pub use run::run;
