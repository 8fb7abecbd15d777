//! Files read whole, with a limit.

use std::{fs, io, path::Path};

use crate::GeometryError;

/// The bytes of the regular file at `path`, at most `max_bytes`. It never waits: pipes and devices are refused.
///
/// # Errors
/// [`GeometryError::Io`] where the file cannot be read, [`GeometryError::Format`] where it is larger or not a regular file.
pub fn read_limited(path: &Path, max_bytes: u64) -> Result<Vec<u8>, GeometryError> {
    let wrap = |e: io::Error| GeometryError::io(path, e);
    let metadata = fs::metadata(path).map_err(wrap)?;
    if metadata.is_dir() {
        return Err(GeometryError::format(path, "is a folder; give the file in it"));
    }
    if !metadata.is_file() {
        return Err(GeometryError::format(path, "is not a regular file; copy what it holds into one"));
    }
    if metadata.len() > max_bytes {
        let reason = format!("holds {} bytes; at most {max_bytes} can be read", metadata.len());
        return Err(GeometryError::format(path, reason));
    }
    fs::read(path).map_err(wrap)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_devices_and_large_files_are_refused() {
        let refused = |path: &str, limit| read_limited(Path::new(path), limit).unwrap_err().to_string();
        assert!(refused("src", 10).contains("is a folder"));
        assert!(refused("/dev/null", 10).contains("not a regular file"));
        assert!(refused("Cargo.toml", 10).contains("at most 10"));
        let length = std::fs::metadata("Cargo.toml").unwrap().len();
        assert!(read_limited(Path::new("Cargo.toml"), length).is_ok());
        assert!(refused("Cargo.toml", length - 1).contains("can be read"));
        assert!(read_limited(Path::new("Cargo.toml"), 1 << 20).unwrap().starts_with(b"[package]"));
    }
}
