//! The infrared pair's buffer to two images, pure.

use toile_capture::{
    RgbImage,
    pixels::{PixelError, Rows},
};

/// Left and right infrared of a Y8I buffer, as grey.
///
/// # Errors
/// [`PixelError::Short`].
pub fn infrared_pair(bytes: &[u8], rows: Rows) -> Result<[RgbImage; 2], PixelError> {
    let pairs: Vec<[u8; 2]> = rows.of(bytes, 2)?.flat_map(|row| row.as_chunks::<2>().0).copied().collect();
    let side = |k: usize| RgbImage {
        width: rows.width,
        height: rows.height,
        pixels: pairs.iter().map(|pair| [pair[k]; 3]).collect(),
    };
    Ok([side(0), side(1)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn padding_is_left_out_and_pairs_are_parted() {
        let rows = Rows { width: 2, height: 2, stride: 6 };
        let [left, right] = infrared_pair(&[1, 0, 2, 1, 99, 99, 3, 0, 4, 1], rows).unwrap();
        assert_eq!((left.pixels[1], right.pixels[3]), ([2; 3], [1; 3]));
        assert!(infrared_pair(&[0; 9], rows).is_err());
    }
}
