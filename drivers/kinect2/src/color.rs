//! The camera's JPEG to pixels, pure.

use image::{ImageDecoder, codecs::jpeg::JpegDecoder};
use toile_capture::RgbImage;

use crate::Kinect2Error;

/// Columns of colour.
pub const COLOR_COLUMNS: usize = 1920;
/// Rows of colour.
pub const COLOR_ROWS: usize = 1080;

/// Pixels of a JPEG, row by row, mirrored as they are sent.
///
/// # Errors
/// [`Kinect2Error::Color`] where it is not a JPEG, or of another size.
pub fn decode(jpeg: &[u8]) -> Result<Vec<[u8; 3]>, Kinect2Error> {
    let wrong = |error: image::ImageError| Kinect2Error::Color(error.to_string());
    let decoder = JpegDecoder::new(std::io::Cursor::new(jpeg)).map_err(wrong)?;
    let (size, color) = (decoder.dimensions(), decoder.color_type());
    // Looked at before memory is taken for the pixels.
    if size != (COLOR_COLUMNS as u32, COLOR_ROWS as u32) || color != image::ColorType::Rgb8 {
        return Err(Kinect2Error::Color(format!(
            "{} × {} of {color:?} instead of 1920 × 1080 colours",
            size.0, size.1
        )));
    }
    let mut pixels = vec![[0; 3]; COLOR_COLUMNS * COLOR_ROWS];
    decoder.read_image(pixels.as_flattened_mut()).map_err(wrong)?;
    Ok(pixels)
}

/// Turns mirrored pixels round.
pub fn unmirrored(mut pixels: Vec<[u8; 3]>) -> RgbImage {
    pixels.chunks_exact_mut(COLOR_COLUMNS).for_each(<[_]>::reverse);
    RgbImage { width: COLOR_COLUMNS as u32, height: COLOR_ROWS as u32, pixels }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn other_images_than_the_cameras_are_refused() {
        assert!(decode(&[0xff, 0xd8, 0xff, 0xd9]).is_err());
        let mut small = Vec::new();
        image::codecs::jpeg::JpegEncoder::new(&mut small)
            .encode(&[9; 48], 4, 4, image::ExtendedColorType::Rgb8)
            .unwrap();
        assert!(decode(&small).unwrap_err().to_string().contains("4 × 4"));
    }

    proptest! {
        #[test]
        fn no_bytes_upset_it(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
            let _ = decode(&[&[0xff, 0xd8][..], &bytes].concat());
        }
    }
}
