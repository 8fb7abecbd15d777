//! Buffer bytes to pictures, pure.

use toile_capture::{
    ColorImage, RgbImage,
    pixels::{self, Rows},
};

/// The content of a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PixelFormat {
    /// A JPEG.
    Mjpg,
    /// Brightness of every pixel, colour of every second (V4L2_PIX_FMT_YUYV).
    Yuyv,
    /// Brightness alone (V4L2_PIX_FMT_GREY).
    Grey,
}

/// Layout of a buffer as V4L2 reports it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Its content.
    pub format: PixelFormat,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Bytes from one row to the next; 0 for JPEG.
    pub stride: u32,
}

/// The picture in a buffer.
///
/// # Errors
/// A sentence where the buffer is short, a JPEG is torn, or the size is another.
pub fn picture(bytes: &[u8], layout: Layout) -> Result<RgbImage, String> {
    let Layout { format, width, height, stride } = layout;
    let rows = Rows { width, height, stride };
    let converted = match format {
        PixelFormat::Mjpg => return jpeg(bytes, width, height),
        PixelFormat::Yuyv => pixels::yuyv(bytes, rows),
        PixelFormat::Grey => pixels::grey(bytes, rows),
    };
    converted.map_err(|error| format!("is not whole: {error}"))
}

fn jpeg(bytes: &[u8], width: u32, height: u32) -> Result<RgbImage, String> {
    let whole = pixels::whole_jpeg(bytes)
        .ok_or_else(|| format!("is torn: a JPEG of {} bytes without a start or an end", bytes.len()))?;
    let image = ColorImage::Jpeg(whole.into()).decode(0).map_err(|e| format!("is torn: {e}"))?;
    if (image.width, image.height) != (width, height) {
        return Err(format!("has {}x{} pixels where {width}x{height} were agreed on", image.width, image.height));
    }
    Ok(std::sync::Arc::unwrap_or_clone(image))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn layout(format: PixelFormat, width: u32, height: u32, stride: u32) -> Layout {
        Layout { format, width, height, stride }
    }

    #[test]
    fn grey_and_yuyv_leave_the_padding_out() {
        let grey = picture(&[1, 2, 99, 3, 4], layout(PixelFormat::Grey, 2, 2, 3)).unwrap();
        assert_eq!(grey.pixels, [[1; 3], [2; 3], [3; 3], [4; 3]]);
        let yuyv = picture(&[16, 128, 235, 128, 7, 81, 90, 81, 240], layout(PixelFormat::Yuyv, 2, 2, 5)).unwrap();
        assert_eq!(yuyv.pixels[..2], [[0; 3], [255; 3]]);
    }

    #[test]
    fn short_and_torn_pictures_are_refused_with_the_reason() {
        let short = picture(&[0; 7], layout(PixelFormat::Yuyv, 2, 2, 4)).unwrap_err();
        assert!(short.contains("7 bytes") && short.contains("need 8"), "{short}");
        let torn = picture(&[0xff, 0xd8, 1, 2], layout(PixelFormat::Mjpg, 2, 2, 0)).unwrap_err();
        assert!(torn.contains("torn"), "{torn}");
        assert!(picture(&[0xff, 0xd8, 0xff, 0xd9], layout(PixelFormat::Mjpg, 2, 2, 0)).is_err());
        let mut whole = Vec::new();
        let encoder = jpeg_encoder::Encoder::new(&mut whole, 90);
        encoder.encode(&[80; 3 * 8 * 6], 8, 6, jpeg_encoder::ColorType::Rgb).unwrap();
        assert!(picture(&whole, layout(PixelFormat::Mjpg, 8, 6, 0)).is_ok());
        let other = picture(&whole, layout(PixelFormat::Mjpg, 6, 8, 0)).unwrap_err();
        assert!(other.contains("8x6 pixels where 6x8"), "{other}");
    }

    proptest! {
        #[test]
        fn no_buffer_makes_it_panic(
            bytes in proptest::collection::vec(any::<u8>(), 0..200), width in 0u32..20, height in 0u32..20,
            stride in 0u32..50, format in 0usize..3,
        ) {
            let format = [PixelFormat::Mjpg, PixelFormat::Yuyv, PixelFormat::Grey][format];
            if let Ok(image) = picture(&bytes, layout(format, width, height, stride)) {
                prop_assert_eq!(image.pixels.len(), (width * height) as usize);
            }
        }
    }
}
