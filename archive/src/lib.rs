//! Many subjects: what is stale, running it side by side, the catalogue, and moving, checking and forgetting archives.
//!
//! An **archive** is a folder that holds subjects, directly or in folders of its own. No stage's algorithm lives here: a subject
//! is processed by the program itself, in a process of its own, so that one that crashes or needs too much memory costs
//! nobody else anything. What an archive knows about itself lies in `ARCHIVE/.toile/` and can be deleted and built again,
//! but for the tombstones of people who were removed.
//!
//! - [`subjects`]: where they are;
//! - [`batch::Outlook`]: what is to be done, from one small file a subject, and how long it will take;
//! - [`batch::run`]: doing it, by cores and memory; [`batch::Event`]: what is heard meanwhile;
//! - [`catalog`]: an SQLite file about all of it;
//! - [`anonymize()`]: a copy of a subject in which nobody is recognised;
//! - [`compare`]: what another version made different;
//! - [`keep`]: checking, packing, unpacking and forgetting;
//! - `remote` (feature `cloud`): archives in buckets.
//!
//! ```
//! # fn main() -> Result<(), toile_archive::ArchiveError> {
//! let empty = std::env::temp_dir().join("toile-archive-example");
//! std::fs::create_dir_all(&empty).ok();
//! assert!(toile_archive::subjects(&empty)?.is_empty());
//! # Ok(())
//! # }
//! ```

mod anonymize;
pub mod batch;
pub mod catalog;
pub mod compare;
mod error;
mod find;
pub mod keep;
#[cfg(feature = "cloud")]
pub mod remote;
mod state;

pub use anonymize::{Anonymized, anonymize};
pub use error::ArchiveError;
pub use find::subjects;
