//! Device pixels to images.

use std::sync::Arc;

use toile_capture::{ColorImage, RgbImage};

use crate::WebcamError;

/// A JPEG as the device sent it: checked for its markers, padding behind the end marker left out.
///
/// # Errors
/// [`WebcamError::Pixels`] where start or end marker is missing (a torn frame).
pub fn jpeg(bytes: &[u8]) -> Result<ColorImage, WebcamError> {
    let end = bytes.windows(2).rposition(|w| w == [0xff, 0xd9]);
    match (bytes.starts_with(&[0xff, 0xd8]), end) {
        (true, Some(end)) => Ok(ColorImage::Jpeg(bytes[..end + 2].into())),
        _ => Err(WebcamError::Pixels(format!("a JPEG of {} bytes came without start or end", bytes.len()))),
    }
}

/// YUYV (YUV 4:2:2, BT.601 studio range) to RGB.
///
/// # Errors
/// [`WebcamError::Pixels`] where the bytes do not make up the image.
pub fn yuyv(bytes: &[u8], width: u32, height: u32) -> Result<ColorImage, WebcamError> {
    let needed = width as usize * height as usize * 2;
    if !width.is_multiple_of(2) || bytes.len() < needed {
        return Err(WebcamError::Pixels(format!("{} bytes of YUYV for {width}x{height}", bytes.len())));
    }
    let pairs = bytes[..needed].chunks_exact(4);
    let pixels = pairs.flat_map(|q| [rgb(q[0], q[1], q[3]), rgb(q[2], q[1], q[3])]).collect();
    Ok(ColorImage::Rgb(Arc::new(RgbImage { width, height, pixels })))
}

/// ITU-R BT.601, studio range.
fn rgb(y: u8, u: u8, v: u8) -> [u8; 3] {
    let (y, u, v) = (1.164 * (f32::from(y) - 16.0), f32::from(u) - 128.0, f32::from(v) - 128.0);
    [y + 1.596 * v, y - 0.392 * u - 0.813 * v, y + 2.017 * u].map(|c| c.round().clamp(0.0, 255.0) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grey_stays_grey_and_red_is_red() {
        let ColorImage::Rgb(image) = yuyv(&[16, 128, 235, 128, 81, 90, 81, 240], 2, 2).unwrap() else {
            panic!("YUYV gives pixels")
        };
        assert_eq!(image.pixels[0], [0, 0, 0]);
        assert_eq!(image.pixels[1], [255, 255, 255]);
        let [r, g, b] = image.pixels[2];
        assert!(r > 250 && g < 5 && b < 5, "{r} {g} {b}");
    }

    #[test]
    fn a_short_image_and_a_torn_jpeg_are_refused() {
        assert!(yuyv(&[0; 7], 2, 2).is_err());
        assert!(jpeg(&[0xff, 0xd8, 1, 2, 3]).is_err());
        let Ok(ColorImage::Jpeg(bytes)) = jpeg(&[0xff, 0xd8, 1, 0xff, 0xd9, 0, 0]) else { panic!("whole") };
        assert_eq!(bytes.len(), 5);
    }
}
