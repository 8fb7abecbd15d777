//! PNG files.

use std::io::Cursor;

use image::{ImageFormat, RgbImage};

use crate::RenderError;

/// The bytes of a PNG file.
///
/// # Errors
/// [`RenderError::Encode`] where the image has no pixels.
pub fn encode(image: &RgbImage) -> Result<Vec<u8>, RenderError> {
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, ImageFormat::Png)?;
    Ok(bytes.into_inner())
}
