//! Reading image files, with their size checked against the calibration.

use std::path::Path;

use image::{DynamicImage, ImageFormat};
use toile_geometry::camera::PinholeCamera;
use zune_jpeg::{JpegDecoder, zune_core::bytestream::ZCursor};

use crate::{CaptureError, ColorImage, DepthImage};

/// Reads a 16-bit PNG of the depth camera's size.
pub(super) fn read_depth(path: &Path, camera: &PinholeCamera) -> Result<DepthImage, CaptureError> {
    let bytes = read(path)?;
    check_size(path, png_size(path, &bytes)?, camera)?;
    match image::load_from_memory_with_format(&bytes, ImageFormat::Png) {
        Ok(DynamicImage::ImageLuma16(image)) => {
            Ok(DepthImage { width: image.width(), height: image.height(), values: image.into_raw() })
        }
        Ok(other) => Err(CaptureError::format(
            path,
            format!("depth must be a 16-bit grey PNG, but this one is {:?}", other.color()),
        )),
        Err(error) => Err(CaptureError::format(path, format!("is no readable PNG: {error}"))),
    }
}

/// Reads a JPEG or PNG of the colour camera's size; its bytes are kept as they are.
pub(super) fn read_color(path: &Path, camera: &PinholeCamera) -> Result<ColorImage, CaptureError> {
    let bytes = read(path)?;
    check_size(path, size(path, &bytes)?, camera)?;
    if is_png(&bytes) { Ok(ColorImage::Png(bytes.into())) } else { Ok(ColorImage::Jpeg(bytes.into())) }
}

/// Sets depth to 0 where the mask image is dark.
pub(super) fn apply_mask(path: &Path, depth: &mut DepthImage) -> Result<(), CaptureError> {
    let mask = image::load_from_memory(&read(path)?)
        .map_err(|error| CaptureError::format(path, format!("is no readable mask: {error}")))?
        .to_luma8();
    if (mask.width(), mask.height()) != (depth.width, depth.height) {
        return Err(CaptureError::format(path, "the mask has another size than the depth"));
    }
    for (value, inside) in depth.values.iter_mut().zip(mask.into_raw()) {
        if inside < 128 {
            *value = 0;
        }
    }
    Ok(())
}

/// Columns and rows of an image file, from its header alone.
pub(super) fn file_size(path: &Path) -> Result<(u32, u32), CaptureError> {
    size(path, &read(path)?)
}

fn size(path: &Path, bytes: &[u8]) -> Result<(u32, u32), CaptureError> {
    if is_png(bytes) { png_size(path, bytes) } else { jpeg_size(path, bytes) }
}

fn read(path: &Path) -> Result<Vec<u8>, CaptureError> {
    std::fs::read(path).map_err(|error| CaptureError::io(path, error))
}

fn is_png(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\x89PNG\r\n\x1a\n")
}

fn png_size(path: &Path, bytes: &[u8]) -> Result<(u32, u32), CaptureError> {
    image::ImageReader::with_format(std::io::Cursor::new(bytes), ImageFormat::Png)
        .into_dimensions()
        .map_err(|error| CaptureError::format(path, format!("is no readable PNG: {error}")))
}

fn jpeg_size(path: &Path, bytes: &[u8]) -> Result<(u32, u32), CaptureError> {
    let mut decoder = JpegDecoder::new(ZCursor::new(bytes));
    decoder
        .decode_headers()
        .map_err(|error| CaptureError::format(path, format!("is neither a readable JPEG nor a PNG: {error}")))?;
    let (width, height) =
        decoder.dimensions().ok_or_else(|| CaptureError::format(path, "the JPEG does not say its size"))?;
    Ok((width as u32, height as u32))
}

fn check_size(path: &Path, (width, height): (u32, u32), camera: &PinholeCamera) -> Result<(), CaptureError> {
    if (width, height) == (camera.width, camera.height) {
        return Ok(());
    }
    let reason = format!(
        "the image has {width} x {height} pixels, but the calibration is for {} x {}",
        camera.width, camera.height
    );
    Err(CaptureError::format(path, reason))
}
