//! Pixels as cameras send them to images, pure: rows with padding, 16-bit depth, grey, YUYV colours, JPEG markers.
//!
//! Layouts are those of `linux/videodev2.h`. Every length that a device states is checked before it is used.

use crate::{DepthImage, RgbImage};

/// How the rows of a picture lie in a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rows {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Bytes from the start of one row to the start of the next; more than a row's own bytes where it is padded.
    pub stride: u32,
}

/// Why a buffer is not a picture.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PixelError {
    /// The buffer is shorter than its layout needs, or the layout is impossible.
    #[error("a buffer holds {bytes} bytes where {width}x{height} pixels at {stride} bytes a row need {needed}")]
    Short {
        /// Bytes that came.
        bytes: usize,
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// Bytes from row to row.
        stride: u32,
        /// Bytes that are needed.
        needed: usize,
    },
    /// Two neighbours share a colour in YUYV, so a row has an even number of pixels.
    #[error("a row of YUYV has {0} pixels, but their number must be even")]
    OddWidth(u32),
}

impl Rows {
    /// The bytes of each row for pixels of `bytes_per_pixel`, padding left out.
    ///
    /// # Errors
    /// [`PixelError::Short`] where the last row is not whole, or a row is longer than the stride.
    pub fn of(self, bytes: &[u8], bytes_per_pixel: usize) -> Result<impl Iterator<Item = &[u8]>, PixelError> {
        let Self { width, height, stride } = self;
        let (row, step, count) = (width as usize * bytes_per_pixel, stride as usize, height as usize);
        let needed = step.saturating_mul(count.saturating_sub(1)).saturating_add(row);
        if count == 0 || step < row || bytes.len() < needed {
            return Err(PixelError::Short { bytes: bytes.len(), width, height, stride, needed });
        }
        Ok((0..count).map(move |v| &bytes[v * step..][..row]))
    }
}

/// Depth of 16 bits, little-endian (V4L2_PIX_FMT_Z16 and _Y16), in the device's units; 0 where there is none.
///
/// # Errors
/// [`PixelError::Short`].
pub fn depth16(bytes: &[u8], rows: Rows) -> Result<DepthImage, PixelError> {
    let values = rows.of(bytes, 2)?.flat_map(|row| row.as_chunks::<2>().0.iter().map(|b| u16::from_le_bytes(*b)));
    Ok(DepthImage { width: rows.width, height: rows.height, values: values.collect() })
}

/// Brightness alone (V4L2_PIX_FMT_GREY), as grey.
///
/// # Errors
/// [`PixelError::Short`].
pub fn grey(bytes: &[u8], rows: Rows) -> Result<RgbImage, PixelError> {
    let pixels = rows.of(bytes, 1)?.flatten().map(|&y| [y; 3]).collect();
    Ok(RgbImage { width: rows.width, height: rows.height, pixels })
}

/// Brightness of every pixel, colour of every second one (V4L2_PIX_FMT_YUYV).
///
/// # Errors
/// [`PixelError`].
pub fn yuyv(bytes: &[u8], rows: Rows) -> Result<RgbImage, PixelError> {
    if !rows.width.is_multiple_of(2) {
        return Err(PixelError::OddWidth(rows.width));
    }
    let two = |[y0, u, y1, v]: &[u8; 4]| [rgb_from_yuv(*y0, *u, *v), rgb_from_yuv(*y1, *u, *v)];
    let pixels = rows.of(bytes, 2)?.flat_map(|row| row.as_chunks::<4>().0.iter().flat_map(two));
    Ok(RgbImage { width: rows.width, height: rows.height, pixels: pixels.collect() })
}

/// A colour of ITU-R BT.601 in studio range (brightness 16 to 235), in 1/256 and rounded: within one step of the formula.
pub fn rgb_from_yuv(y: u8, u: u8, v: u8) -> [u8; 3] {
    let (y, u, v) = (298 * (i32::from(y) - 16), i32::from(u) - 128, i32::from(v) - 128);
    [y + 409 * v, y - 100 * u - 208 * v, y + 516 * u].map(|c| ((c + 128) >> 8).clamp(0, 255) as u8)
}

/// The bytes of a JPEG from its start marker to its last end marker, what a device pads behind it left out; `None` where
/// one of the markers is missing, which a torn picture shows.
pub fn whole_jpeg(bytes: &[u8]) -> Option<&[u8]> {
    let end = bytes.windows(2).rposition(|pair| pair == [0xff, 0xd9])?;
    bytes.starts_with(&[0xff, 0xd8]).then(|| &bytes[..end + 2])
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn padding_is_left_out() {
        let rows = |width, height, stride| Rows { width, height, stride };
        assert_eq!(depth16(&[1, 0, 2, 0, 99, 99, 3, 0, 0, 1], rows(2, 2, 6)).unwrap().values, [1, 2, 3, 256]);
        assert_eq!(grey(&[1, 2, 99, 3, 4], rows(2, 2, 3)).unwrap().pixels, [[1; 3], [2; 3], [3; 3], [4; 3]]);
        let colors = yuyv(&[16, 128, 235, 128, 7, 81, 90, 81, 240], rows(2, 2, 5)).unwrap().pixels;
        assert_eq!(colors[..2], [[0; 3], [255; 3]]);
        let [r, g, b] = colors[2];
        assert!(r > 250 && g < 5 && b < 5, "{r} {g} {b}");
    }

    /// The recommendation's formula in floating point.
    #[test]
    fn colours_are_those_of_the_recommendation_within_one_step() {
        for (y, u, v) in (0..=255).flat_map(|y| (0..=255).step_by(5).flat_map(move |u| [(y, u, 255 - u), (y, u, u)])) {
            let luma = 255.0 / 219.0 * (f64::from(y) - 16.0);
            let (blue, red) = (255.0 / 224.0 * (f64::from(u) - 128.0), 255.0 / 224.0 * (f64::from(v) - 128.0));
            let green = luma - 0.114 / 0.587 * 1.772 * blue - 0.299 / 0.587 * 1.402 * red;
            let truth = [luma + 1.402 * red, green, luma + 1.772 * blue];
            let near = |seen: u8, truth: f64| (f64::from(seen) - truth.clamp(0.0, 255.0)).abs() <= 1.0;
            let seen = rgb_from_yuv(y, u, v);
            assert!(seen.iter().zip(truth).all(|(s, t)| near(*s, t)), "{y} {u} {v}: {seen:?}, {truth:?}");
        }
    }

    #[test]
    fn torn_jpegs_and_odd_rows_are_refused() {
        assert_eq!(whole_jpeg(&[0xff, 0xd8, 1, 0xff, 0xd9, 0, 0]).map(<[u8]>::len), Some(5));
        for torn in [&[][..], &[0xff, 0xd8, 1, 2, 3], &[0, 0xff, 0xd8, 0xff, 0xd9], &[0xff, 0xd9]] {
            assert_eq!(whole_jpeg(torn), None);
        }
        let odd = yuyv(&[0; 99], Rows { width: 3, height: 1, stride: 8 }).unwrap_err();
        assert!(odd.to_string().contains("3 pixels"));
        let short = yuyv(&[0; 7], Rows { width: 2, height: 2, stride: 4 }).unwrap_err().to_string();
        assert!(short.contains("7 bytes") && short.contains("need 8"), "{short}");
    }

    proptest! {
        #[test]
        fn no_layout_makes_it_panic(
            bytes in prop::collection::vec(any::<u8>(), 0..200), width in 0..40u32, height in 0..40u32, stride in 0..97u32,
        ) {
            let rows = Rows { width, height, stride };
            let count = (width * height) as usize;
            prop_assert!(depth16(&bytes, rows).is_ok_and(|image| image.values.len() == count) || depth16(&bytes, rows).is_err());
            for image in [grey(&bytes, rows), yuyv(&bytes, rows)].into_iter().flatten() {
                prop_assert_eq!(image.pixels.len(), count);
            }
            for huge in [u32::MAX, u32::MAX / 2] {
                let rows = Rows { width: huge, height: huge, stride: huge };
                prop_assert!(depth16(&bytes, rows).is_err());
            }
        }
    }
}
