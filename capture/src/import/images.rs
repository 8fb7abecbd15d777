//! Reading image files, with their size checked against the calibration.

use std::path::Path;

use toile_geometry::camera::PinholeCamera;

use crate::{CaptureError, ColorImage, DepthImage, encoded, files};

fn read_bytes(path: &Path) -> Result<Vec<u8>, CaptureError> {
    files::read_limited(path, files::MAX_IMAGE_BYTES)
}

/// Reads a 16-bit PNG of the depth camera's size.
pub(super) fn read_depth(path: &Path, camera: &PinholeCamera) -> Result<DepthImage, CaptureError> {
    let bytes = read_bytes(path)?;
    check_size(path, &bytes, camera)?;
    encoded::decode_depth_png(&bytes).map_err(|reason| CaptureError::format(path, reason))
}

/// Reads a JPEG or PNG of the colour camera's size; its bytes are kept as they are.
pub(super) fn read_color(path: &Path, camera: &PinholeCamera) -> Result<ColorImage, CaptureError> {
    let bytes = read_bytes(path)?;
    check_size(path, &bytes, camera)?;
    if encoded::is_png(&bytes) { Ok(ColorImage::Png(bytes.into())) } else { Ok(ColorImage::Jpeg(bytes.into())) }
}

/// Sets depth to 0 where the mask image is dark.
pub(super) fn apply_mask(path: &Path, depth: &mut DepthImage) -> Result<(), CaptureError> {
    let mask = encoded::decode_mask(&read_bytes(path)?).map_err(|reason| CaptureError::format(path, reason))?;
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
    encoded::size(&read_bytes(path)?).map_err(|reason| CaptureError::format(path, reason))
}

fn check_size(path: &Path, bytes: &[u8], camera: &PinholeCamera) -> Result<(), CaptureError> {
    let (width, height) = encoded::size(bytes).map_err(|reason| CaptureError::format(path, reason))?;
    if (width, height) == (camera.width, camera.height) {
        return Ok(());
    }
    let reason = format!(
        "the image has {width} x {height} pixels, but the calibration is for {} x {}",
        camera.width, camera.height
    );
    Err(CaptureError::format(path, reason))
}
