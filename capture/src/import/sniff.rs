//! What a single file is, from its first bytes.

use std::{io::Read, path::Path};

use super::{format::Format, ros};
use crate::{CaptureError, files::open_regular};

/// Bytes at the start of a file that tell what it is.
const HEAD: u64 = 64;

/// Formats that are recognised but not read: first bytes, and what to do.
const NOT_READ: [(&[u8], &str); 3] = [
    (
        b"NI10",
        "is a recording of OpenNI (.oni), whose packed depth is not read; play it once into a ROS bag or PNG images",
    ),
    (
        b"SQLite format 3\0",
        "is a ROS 2 bag in SQLite (.db3), which is not read; `ros2 bag convert` makes an MCAP file of it",
    ),
    (
        b"\x1a\x45\xdf\xa3",
        "is a Matroska recording (.mkv, as k4arecorder and its like write), which is not read; export its \
                           pictures as PNG with a camera.json",
    ),
];

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
    if let Some((_, reason)) = NOT_READ.iter().find(|(magic, _)| head.starts_with(magic)) {
        return Err(CaptureError::format(path, *reason));
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
