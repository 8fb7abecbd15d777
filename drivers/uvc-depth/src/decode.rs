//! Buffer bytes to a depth image.

use toile_capture::DepthImage;

use crate::UvcDepthError;

/// Layout of a depth buffer as V4L2 tells it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Bytes from one row to the next; at least two a column.
    pub stride: u32,
}

/// Decodes 16-bit little-endian depth (V4L2_PIX_FMT_Z16 and _Y16), row padding left out.
///
/// # Errors
/// [`UvcDepthError::ShortBuffer`] where the last row is not whole or the stride is shorter than a row.
pub fn depth16(bytes: &[u8], layout: Layout) -> Result<DepthImage, UvcDepthError> {
    let Layout { width, height, stride } = layout;
    let row = width as usize * 2;
    let needed = (stride as usize) * (height as usize).saturating_sub(1) + row;
    if height == 0 || (stride as usize) < row || bytes.len() < needed {
        return Err(UvcDepthError::ShortBuffer { bytes: bytes.len(), width, height, stride, needed });
    }
    let rows = (0..height as usize).map(|v| &bytes[v * stride as usize..][..row]);
    let values = rows.flat_map(|r| r.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]]))).collect();
    Ok(DepthImage { width, height, values })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn padding_is_left_out() {
        let bytes = [1, 0, 2, 0, 99, 99, 3, 0, 0, 1];
        let image = depth16(&bytes, Layout { width: 2, height: 2, stride: 6 }).unwrap();
        assert_eq!(image.values, vec![1, 2, 3, 256]);
    }

    proptest! {
        #[test]
        fn no_layout_makes_it_panic(
            bytes in proptest::collection::vec(any::<u8>(), 0..200), width in 0u32..40, height in 0u32..40, stride in 0u32..90,
        ) {
            if let Ok(image) = depth16(&bytes, Layout { width, height, stride }) {
                prop_assert_eq!(image.values.len(), (width * height) as usize);
            }
        }
    }
}
