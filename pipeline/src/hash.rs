//! SHA-256 of files and values, as lower-case hexadecimal.

use std::{io::Read, path::Path};

use sha2::{Digest, Sha256};
use toile_capture::files::open_regular;

use crate::PipelineError;

/// Hash of a file's content.
///
/// # Errors
/// [`PipelineError::Io`] where it cannot be read.
pub fn file(path: &Path) -> Result<String, PipelineError> {
    let wrong = |e| PipelineError::io(path, e);
    let mut file = open_regular(path)?;
    let mut sha = Sha256::new();
    let mut buffer = vec![0; 1 << 18];
    loop {
        match file.read(&mut buffer).map_err(wrong)? {
            0 => return Ok(hex(sha)),
            count => sha.update(&buffer[..count]),
        }
    }
}

/// Hash of bytes.
pub fn bytes(bytes: &[u8]) -> String {
    hex(Sha256::new_with_prefix(bytes))
}

fn hex(sha: Sha256) -> String {
    sha.finalize().iter().map(|b| format!("{b:02x}")).collect()
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_standard_vector() {
        assert_eq!(super::bytes(b"abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    }
}
