//! Buffer bytes to pictures, pure.

use toile_capture::{ColorImage, RgbImage};

/// What a buffer holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PixelFormat {
    /// A JPEG.
    Mjpg,
    /// Brightness of every pixel, colour of every second (V4L2_PIX_FMT_YUYV; BT.601, studio range).
    Yuyv,
    /// Brightness alone (V4L2_PIX_FMT_GREY).
    Grey,
}

/// Layout of a buffer as V4L2 tells it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// What it holds.
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
    let Layout { format, width, height, .. } = layout;
    match format {
        PixelFormat::Mjpg => jpeg(bytes, width, height),
        PixelFormat::Yuyv => {
            let pixels = rows(bytes, layout, 2)?.flat_map(|row| row.chunks_exact(4).flat_map(two_pixels)).collect();
            Ok(RgbImage { width, height, pixels })
        }
        PixelFormat::Grey => {
            Ok(RgbImage { width, height, pixels: rows(bytes, layout, 1)?.flatten().map(|&y| [y; 3]).collect() })
        }
    }
}

fn jpeg(bytes: &[u8], width: u32, height: u32) -> Result<RgbImage, String> {
    let end = bytes.windows(2).rposition(|w| w == [0xff, 0xd9]);
    let Some(end) = end.filter(|_| bytes.starts_with(&[0xff, 0xd8])) else {
        return Err(format!("is torn: a JPEG of {} bytes without start or end", bytes.len()));
    };
    let image = ColorImage::Jpeg(bytes[..end + 2].into()).decode(0).map_err(|e| format!("is torn: {e}"))?;
    if (image.width, image.height) != (width, height) {
        return Err(format!("has {}x{} pixels where {width}x{height} were agreed on", image.width, image.height));
    }
    Ok(std::sync::Arc::unwrap_or_clone(image))
}

/// The rows of a buffer, padding left out.
fn rows(bytes: &[u8], layout: Layout, bytes_per_pixel: usize) -> Result<impl Iterator<Item = &[u8]>, String> {
    let (height, row) = (layout.height as usize, layout.width as usize * bytes_per_pixel);
    let stride = layout.stride as usize;
    let needed = stride * height.saturating_sub(1) + row;
    if height == 0 || stride < row || row % (2 * bytes_per_pixel) != 0 || bytes.len() < needed {
        let Layout { width, height, .. } = layout;
        return Err(format!("is short: {} bytes where {width}x{height} pixels need {needed}", bytes.len()));
    }
    Ok((0..height).map(move |v| &bytes[v * stride..][..row]))
}

fn two_pixels(q: &[u8]) -> [[u8; 3]; 2] {
    [rgb(q[0], q[1], q[3]), rgb(q[2], q[1], q[3])]
}

/// ITU-R BT.601, studio range, in 1/256.
fn rgb(y: u8, u: u8, v: u8) -> [u8; 3] {
    let (y, u, v) = (298 * (i32::from(y) - 16), i32::from(u) - 128, i32::from(v) - 128);
    [y + 409 * v, y - 100 * u - 208 * v, y + 516 * u].map(|c| ((c + 128) >> 8).clamp(0, 255) as u8)
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
        let [r, g, b] = yuyv.pixels[2];
        assert!(r > 250 && g < 5 && b < 5, "{r} {g} {b}");
    }

    #[test]
    fn short_and_torn_pictures_are_told() {
        let short = picture(&[0; 7], layout(PixelFormat::Yuyv, 2, 2, 4)).unwrap_err();
        assert!(short.contains("7 bytes") && short.contains("need 8"), "{short}");
        let torn = picture(&[0xff, 0xd8, 1, 2], layout(PixelFormat::Mjpg, 2, 2, 0)).unwrap_err();
        assert!(torn.contains("torn"), "{torn}");
        assert!(picture(&[0xff, 0xd8, 0xff, 0xd9], layout(PixelFormat::Mjpg, 2, 2, 0)).is_err());
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
