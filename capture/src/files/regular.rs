//! Reading files that come from outside.

use std::{
    fs::{self, File, OpenOptions},
    io::{ErrorKind, Read},
    os::unix::fs::OpenOptionsExt,
    path::Path,
};

use rustix::fs::OFlags;

use crate::CaptureError;

/// The largest text file that is read, bytes: calibrations, lists, edits and trajectories stay far below.
const MAX_TEXT_BYTES: u64 = 64 << 20;
/// The largest image file that is read, bytes: 16-bit PNGs of 64 Mi pixels stay below.
pub(crate) const MAX_IMAGE_BYTES: u64 = 160 << 20;
/// The largest file that is read whole for any other purpose, bytes.
const MAX_BYTES: u64 = 1 << 30;

/// True where something has that name, even a link that leads nowhere or a file that may not be read: only a name that is
/// not there at all counts as none.
pub fn is_there(path: &Path) -> bool {
    fs::symlink_metadata(path).map_or_else(|error| error.kind() != ErrorKind::NotFound, |_| true)
}

/// Opens a regular file for reading. Links are followed. A folder, and whatever could block for ever (a FIFO, a socket, a
/// device), is refused at once.
///
/// # Errors
/// [`CaptureError::Io`] where it cannot be opened, [`CaptureError::Format`] where it is not a regular file.
pub fn open_regular(path: &Path) -> Result<File, CaptureError> {
    let wrap = |error: std::io::Error| {
        if error.kind() == ErrorKind::NotFound && is_there(path) {
            return CaptureError::format(path, "is a link to a file that is not there; mend the link or remove it");
        }
        CaptureError::io(path, error)
    };
    // Without this flag, opening a FIFO waits until somebody writes into it.
    let file = OpenOptions::new().read(true).custom_flags(OFlags::NONBLOCK.bits() as i32).open(path).map_err(wrap)?;
    let kind = file.metadata().map_err(wrap)?.file_type();
    match (kind.is_file(), kind.is_dir()) {
        (true, _) => Ok(file),
        (_, true) => Err(CaptureError::format(path, "is a folder; a file is needed here")),
        _ => Err(CaptureError::format(path, "is not a regular file (it is a pipe, a socket or a device); give a file")),
    }
}

/// Reads a whole regular file of at most 1 GiB.
///
/// # Errors
/// As [`open_regular`]; also [`CaptureError::Format`] where it is larger.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>, CaptureError> {
    read_limited(path, MAX_BYTES)
}

/// Reads a whole regular file of at most `most` bytes. A larger one is refused before any of it is read.
///
/// # Errors
/// As [`open_regular`]; also [`CaptureError::Format`] where it is larger.
pub fn read_limited(path: &Path, most: u64) -> Result<Vec<u8>, CaptureError> {
    let wrap = |error| CaptureError::io(path, error);
    let file = open_regular(path)?;
    let length = file.metadata().map_err(wrap)?.len();
    let mut bytes = Vec::new();
    if length <= most {
        file.take(most + 1).read_to_end(&mut bytes).map_err(wrap)?;
    }
    let found = length.max(bytes.len() as u64);
    if found > most {
        let reason = format!("holds {found} bytes, but a file of this kind has at most {} MiB", most >> 20);
        return Err(CaptureError::format(path, reason));
    }
    Ok(bytes)
}

/// Reads a whole text file of at most 64 MiB. A byte order mark at its start is left out.
///
/// # Errors
/// As [`open_regular`]; also [`CaptureError::Format`] where it is too large or not UTF-8.
pub fn read_text(path: &Path) -> Result<String, CaptureError> {
    let mut bytes = Vec::new();
    let limited = open_regular(path)?.take(MAX_TEXT_BYTES + 1).read_to_end(&mut bytes);
    if limited.map_err(|error| CaptureError::io(path, error))? as u64 > MAX_TEXT_BYTES {
        let reason = format!("is larger than {} MiB; a text file is expected here", MAX_TEXT_BYTES >> 20);
        return Err(CaptureError::format(path, reason));
    }
    let text = String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        CaptureError::format(path, format!("is not UTF-8 text (byte {at}); save it as UTF-8"))
    })?;
    Ok(text.strip_prefix('\u{feff}').map_or_else(|| text.clone(), str::to_string))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn pipes_folders_and_devices_are_refused_without_waiting() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("take.mcap");
        let mode = rustix::fs::Mode::RUSR | rustix::fs::Mode::WUSR;
        rustix::fs::mknodat(rustix::fs::CWD, &pipe, rustix::fs::FileType::Fifo, mode, 0).unwrap();
        for path in [pipe.as_path(), Path::new("/dev/zero")] {
            let message = read_bytes(path).unwrap_err().to_string();
            assert!(message.contains("not a regular file"), "{message}");
            assert!(read_text(path).is_err());
        }
        assert!(read_bytes(folder.path()).unwrap_err().to_string().contains("is a folder"));
        assert!(read_bytes(&folder.path().join("none")).unwrap_err().to_string().contains("No such file"));
    }

    #[test]
    fn a_huge_file_is_refused_before_it_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sparse");
        fs::File::create(&path).unwrap().set_len(1 << 41).unwrap();
        for refused in [read_bytes(&path), read_limited(&path, MAX_IMAGE_BYTES)] {
            assert!(refused.unwrap_err().to_string().contains("at most"));
        }
        assert!(read_text(&path).is_err());
        fs::write(&path, [7; 100]).unwrap();
        assert_eq!((read_limited(&path, 100).unwrap().len(), read_limited(&path, 99).is_err()), (100, true));
    }

    #[test]
    fn a_link_that_leads_nowhere_is_there_and_named() {
        let folder = tempfile::tempdir().unwrap();
        let link = folder.path().join("body.json");
        assert!(!is_there(&link));
        std::os::unix::fs::symlink(folder.path().join("gone"), &link).unwrap();
        assert!(is_there(&link) && !link.exists());
        assert!(read_bytes(&link).unwrap_err().to_string().contains("a link to a file that is not there"));
    }

    #[test]
    fn text_loses_its_byte_order_mark_and_must_be_utf8() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("camera.json");
        fs::write(&path, "\u{feff}{}\r\n").unwrap();
        assert_eq!(read_text(&path).unwrap(), "{}\r\n");
        fs::write(&path, b"M\xfcller").unwrap();
        assert!(read_text(&path).unwrap_err().to_string().contains("not UTF-8 text (byte 1)"));
    }
}
