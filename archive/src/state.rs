//! What an archive keeps about itself: `ARCHIVE/.toile/`.

use std::path::{Path, PathBuf};

/// The folder of an archive's own files.
pub(crate) fn folder(archive: &Path) -> PathBuf {
    archive.join(".toile")
}

/// A subject's path in the archive as the name of one file.
pub(crate) fn file_name(subject: &Path) -> String {
    subject.to_string_lossy().replace('%', "%25").replace('/', "%2F")
}
