//! Buffers to images, pure. Layouts of `linux/videodev2.h`; colours by ITU-R BT.601, studio range.

use toile_capture::{DepthImage, RgbImage};
use toile_driver_transport::video::PictureLayout;

/// Depth of a Z16 buffer, row padding left out.
///
/// # Errors
/// A sentence where the buffer is short.
pub fn depth(bytes: &[u8], layout: PictureLayout) -> Result<DepthImage, String> {
    let values = rows(bytes, layout, 2)?.flat_map(|row| row.as_chunks::<2>().0.iter().map(|b| u16::from_le_bytes(*b)));
    Ok(DepthImage { width: layout.width, height: layout.height, values: values.collect() })
}

/// Colour of a YUYV buffer.
///
/// # Errors
/// A sentence where the buffer is short or the rows have an odd number of pixels.
pub fn color(bytes: &[u8], layout: PictureLayout) -> Result<RgbImage, String> {
    if !layout.width.is_multiple_of(2) {
        return Err(format!("rows of {} pixels have no pairs of colours", layout.width));
    }
    let pixels = rows(bytes, layout, 2)?.flat_map(|row| row.as_chunks::<4>().0.iter().flat_map(two_pixels));
    Ok(RgbImage { width: layout.width, height: layout.height, pixels: pixels.collect() })
}

/// Left and right infrared of a Y8I buffer, as grey.
///
/// # Errors
/// A sentence where the buffer is short.
pub fn infrared_pair(bytes: &[u8], layout: PictureLayout) -> Result<[RgbImage; 2], String> {
    let pairs: Vec<[u8; 2]> = rows(bytes, layout, 2)?.flat_map(|row| row.as_chunks::<2>().0).copied().collect();
    let side = |k: usize| RgbImage {
        width: layout.width,
        height: layout.height,
        pixels: pairs.iter().map(|pair| [pair[k]; 3]).collect(),
    };
    Ok([side(0), side(1)])
}

fn rows(bytes: &[u8], layout: PictureLayout, pixel: usize) -> Result<impl Iterator<Item = &[u8]>, String> {
    let (row, height, stride) = (layout.width as usize * pixel, layout.height as usize, layout.stride as usize);
    let needed = stride.saturating_mul(height.saturating_sub(1)).saturating_add(row);
    if height == 0 || stride < row || bytes.len() < needed {
        let PictureLayout { width, height, stride, .. } = layout;
        let length = bytes.len();
        return Err(format!("a buffer holds {length} bytes where {width}x{height} at {stride} a row needs {needed}"));
    }
    Ok((0..height).map(move |v| &bytes[v * stride..][..row]))
}

fn two_pixels(q: &[u8; 4]) -> [[u8; 3]; 2] {
    [rgb(q[0], q[1], q[3]), rgb(q[2], q[1], q[3])]
}

/// In 1/256, rounded.
fn rgb(y: u8, u: u8, v: u8) -> [u8; 3] {
    let (y, u, v) = (298 * (i32::from(y) - 16), i32::from(u) - 128, i32::from(v) - 128);
    [y + 409 * v, y - 100 * u - 208 * v, y + 516 * u].map(|c| ((c + 128) >> 8).clamp(0, 255) as u8)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use toile_driver_transport::video::FourCc;

    use super::*;

    fn layout(width: u32, height: u32, stride: u32) -> PictureLayout {
        PictureLayout { format: FourCc::Z16, width, height, stride }
    }

    #[test]
    fn padding_is_left_out_and_pairs_are_parted() {
        let bytes = [1, 0, 2, 1, 99, 99, 3, 0, 4, 1];
        assert_eq!(depth(&bytes, layout(2, 2, 6)).unwrap().values, [1, 258, 3, 260]);
        let [left, right] = infrared_pair(&bytes, layout(2, 2, 6)).unwrap();
        assert_eq!((left.pixels[1], right.pixels[3]), ([2; 3], [1; 3]));
        let [black, red] =
            [&[16, 128, 16, 128], &[81, 90, 81, 240]].map(|b| color(b, layout(2, 1, 4)).unwrap().pixels[0]);
        assert!(black == [0; 3] && red[0] > 250 && red[1] < 5 && red[2] < 5, "{red:?}");
    }

    proptest! {
        #[test]
        fn no_layout_makes_it_panic(
            bytes in proptest::collection::vec(any::<u8>(), 0..200), width in 0u32..40, height in 0u32..40, stride in any::<u32>(),
        ) {
            let layout = layout(width, height, stride % 97);
            let _ = (depth(&bytes, layout), color(&bytes, layout), infrared_pair(&bytes, layout));
        }
    }
}
