//! Files on disk: written whole or not at all, and read only where they are regular files.
//!
//! Everything that a subject, a scan or an export consists of is written through [`atomic_write()`] or one of its
//! relatives: no link is ever followed, no half file is ever seen, and two processes that write the same file do not
//! disturb each other. Everything that comes from outside is read through [`open_regular`], [`read_bytes`] or
//! [`read_text`]: a FIFO, a socket or a device is refused at once.

mod atomic_write;
mod part;
mod regular;

pub use atomic_write::{atomic_write, atomic_write_all, atomic_write_with};
pub use part::part_path;
pub(crate) use part::{claim, create_parent, sync_parent, with_suffix};
pub(crate) use regular::MAX_IMAGE_BYTES;
pub use regular::{is_there, open_regular, read_bytes, read_limited, read_text};
