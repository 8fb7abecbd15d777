//! A subject on disk: one person at one visit.
//!
//! ```text
//! SUBJECT/
//!   subject.toml                 name, date, rig, the layers in order with their types, notes
//!   pending.toml                 which take is being recorded; only while that lasts
//!   reorder.toml                 which takes are being renamed; only while that lasts
//!   takes/00-body.mcap           one recording a take; never changed after it is closed
//!   takes/00-body.scan/          or a finished scan of another program, as it was given
//!   takes/rejected/              takes that were replaced
//!   edits/01-trousers.json       corrections by hand
//!   build/                       everything in here can be deleted and built again
//! ```
//!
//! [`Subject`] reads; [`LockedSubject`] also writes, and only one process at a time can have it. Whatever writes into a
//! subject's folder without changing its takes (stages, edits) holds a [`SubjectLock`].

mod about;
mod comments;
mod consent;
mod date;
mod layer;
mod lock;
mod locked;
mod pending;
mod reading;
mod reorder;
mod reorder_plan;
mod scan_take;

pub use date::today;
pub use layer::{BODY, Layer};
pub use lock::SubjectLock;
pub use locked::LockedSubject;
pub use pending::PendingTake;
pub use reading::Subject;
pub use reorder::{NewName, Reordered};
pub use scan_take::ScanTake;

/// Reads the text of `subject.toml` and of `pending.toml`; for `fuzz/`.
pub(crate) fn parse(text: &str) {
    let _ = (about::About::parse(text), about::parse_toml::<pending::Note>(text), reorder_plan::Plan::parse(text));
}
