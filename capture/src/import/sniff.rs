//! What a single file is, from its first bytes.

use std::{io::Read, path::Path};

use super::{format::Format, matroska, oni, ros};
use crate::{CaptureError, files::open_regular};

/// Bytes at the start of a file that tell what it is.
const HEAD: u64 = 64;

/// The format of a file.
///
/// # Errors
/// [`CaptureError`] with what to do for formats that are recognised but not read. Whatever is not recognised counts as MCAP,
/// whose reader says what is wrong with it.
pub(super) fn file(path: &Path) -> Result<Format, CaptureError> {
    let mut head = Vec::new();
    let file = open_regular(path)?;
    file.take(HEAD).read_to_end(&mut head).map_err(|error| CaptureError::io(path, error))?;
    if head.starts_with(ros::BAG_MAGIC) {
        return Ok(Format::Bag);
    }
    if head.starts_with(ros::SQLITE_MAGIC) {
        return Ok(Format::Ros2Bag);
    }
    if head.starts_with(matroska::MAGIC) {
        return Ok(Format::Mkv);
    }
    if head.starts_with(oni::MAGIC) {
        return Ok(Format::Oni);
    }
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    match (extension.as_str(), head.starts_with(b"PK")) {
        ("r3d", true) => return Ok(Format::Record3d),
        (_, true) => return Err(CaptureError::format(path, "is a ZIP archive; unpack it and import the folder")),
        ("sens", _) => return Ok(Format::Sens),
        _ => {}
    }
    Ok(if ros::holds_ros(path) { Format::RosMcap } else { Format::Mcap })
}
