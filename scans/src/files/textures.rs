//! Pictures of materials.

use std::{io::Cursor, sync::Arc};

use image::{ImageReader, Limits, RgbImage};

use super::Beside;

/// The largest picture, bytes.
pub(super) const MAX_BYTES: u64 = 512 << 20;
/// Columns and rows are never more than this: 16k textures.
const MAX_SIDE: u32 = 16_384;
/// What decoding a picture may take, bytes: 16-bit RGBA of 16k by 16k pixels.
const MAX_MEMORY: u64 = 2 << 30;

/// Decodes a JPEG or PNG.
///
/// # Errors
/// What is wrong with it.
pub(super) fn decode(bytes: &[u8]) -> Result<Arc<RgbImage>, String> {
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|error| error.to_string())?;
    let mut limits = Limits::default();
    (limits.max_image_width, limits.max_image_height) = (Some(MAX_SIDE), Some(MAX_SIDE));
    limits.max_alloc = Some(MAX_MEMORY);
    reader.limits(limits);
    let picture = reader.decode().map_err(|error| format!("is neither a readable JPEG nor a PNG: {error}"))?.to_rgb8();
    if picture.width() == 0 || picture.height() == 0 {
        return Err("is an empty picture".into());
    }
    Ok(Arc::new(picture))
}

/// The picture of that name beside a mesh file.
///
/// # Errors
/// A sentence where it is missing or cannot be read.
pub(super) fn read(name: &str, beside: &Beside) -> Result<Arc<RgbImage>, String> {
    decode(&beside.read(name, MAX_BYTES)?)
        .map_err(|reason| format!("the picture `{}` {reason}", super::printable(name)))
}
