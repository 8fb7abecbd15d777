//! Device pixels to images.

use std::sync::Arc;

use toile_capture::{
    ColorImage,
    pixels::{self, Rows},
};

use crate::WebcamError;

/// A JPEG as the device sent it: checked for its markers, padding behind the end marker left out.
///
/// # Errors
/// [`WebcamError::Pixels`] where the start or the end marker is missing (a torn frame).
pub(crate) fn jpeg(bytes: &[u8]) -> Result<ColorImage, WebcamError> {
    let whole = pixels::whole_jpeg(bytes).ok_or_else(|| {
        WebcamError::Pixels(format!("a JPEG of {} bytes came without a start or an end", bytes.len()))
    })?;
    Ok(ColorImage::Jpeg(whole.into()))
}

/// YUYV to RGB; nokhwa's rows have no padding.
///
/// # Errors
/// [`WebcamError::Pixels`] where the bytes do not make up the image.
pub(crate) fn yuyv(bytes: &[u8], width: u32, height: u32) -> Result<ColorImage, WebcamError> {
    let rows = Rows { width, height, stride: width.saturating_mul(2) };
    let image = pixels::yuyv(bytes, rows).map_err(|error| WebcamError::Pixels(error.to_string()))?;
    Ok(ColorImage::Rgb(Arc::new(image)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grey_stays_grey() {
        let ColorImage::Rgb(image) = yuyv(&[16, 128, 235, 128, 81, 90, 81, 240], 2, 2).unwrap() else {
            panic!("YUYV gives pixels")
        };
        assert_eq!(image.pixels[0], [0, 0, 0]);
        assert_eq!(image.pixels[1], [255, 255, 255]);
    }

    #[test]
    fn a_short_image_and_a_torn_jpeg_are_refused() {
        assert!(yuyv(&[0; 7], 2, 2).is_err());
        assert!(jpeg(&[0xff, 0xd8, 1, 2, 3]).is_err());
        let Ok(ColorImage::Jpeg(bytes)) = jpeg(&[0xff, 0xd8, 1, 0xff, 0xd9, 0, 0]) else { panic!("whole") };
        assert_eq!(bytes.len(), 5);
    }
}
