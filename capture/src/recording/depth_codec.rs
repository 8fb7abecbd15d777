//! Lossless compression of 16-bit depth images, `toile-depth-1`.
//!
//! The bytes, little-endian:
//!
//! | Offset | Size | What |
//! |---|---|---|
//! | 0 | 4 | the letters `TDZ1` |
//! | 4 | 4 | width W, pixels (u32) |
//! | 8 | 4 | height H, pixels (u32) |
//! | 12 | to the end | one zstd frame that unpacks to exactly 2·W·H bytes |
//!
//! The unpacked bytes are two planes of W·H bytes each: first the low, then the high bytes of one 16-bit code a pixel,
//! row by row. A code is the zigzag (0, −1, 1, −2, 2, … → 0, 1, 2, 3, 4, …) of the difference, modulo 2¹⁶, between the
//! pixel and the pixel on its left; in the first column the pixel above; in the corner 0.

use crate::DepthImage;

/// The maximum number of pixels of an image (64 Mi): a larger one is refused before anything is allocated.
pub const MAX_PIXELS: u64 = 1 << 26;

/// The name by which recordings say that depth is packed this way.
pub const NAME: &str = "toile-depth-1";

const MAGIC: &[u8; 4] = b"TDZ1";
const HEADER_LENGTH: usize = 12;
const ZSTD_LEVEL: i32 = 1;

/// Why bytes are not a depth image (or an image cannot be packed).
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum DepthCodecError {
    /// The bytes do not start as this codec's do.
    #[error("the depth is not packed as {NAME}")]
    Foreign,
    /// Width, height and the number of values do not fit together, or are too large.
    #[error("a depth image of {width} x {height} pixels with {count} values cannot be packed or unpacked")]
    Size {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// Values that came with them.
        count: usize,
    },
    /// The packed bytes are damaged or cut off.
    #[error("the packed depth is damaged: {0}")]
    Damaged(String),
}

/// Packs an image.
///
/// # Errors
/// [`DepthCodecError::Size`] where the number of values is not width times height, or there are too many.
pub fn encode(image: &DepthImage) -> Result<Vec<u8>, DepthCodecError> {
    let count = pixel_count(image.width, image.height)?;
    if count != image.values.len() {
        return Err(size_error(image.width, image.height, image.values.len()));
    }
    let planes = to_planes(&image.values, image.width as usize);
    let packed =
        zstd::bulk::compress(&planes, ZSTD_LEVEL).map_err(|error| DepthCodecError::Damaged(error.to_string()))?;
    let mut bytes = Vec::with_capacity(HEADER_LENGTH + packed.len());
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&image.width.to_le_bytes());
    bytes.extend_from_slice(&image.height.to_le_bytes());
    bytes.extend_from_slice(&packed);
    Ok(bytes)
}

/// Width and height that packed bytes claim, without unpacking them.
///
/// # Errors
/// [`DepthCodecError`] where the header is missing, foreign or claims too many pixels.
pub fn size(bytes: &[u8]) -> Result<(u32, u32), DepthCodecError> {
    let (magic, rest) = bytes.split_first_chunk::<4>().ok_or(DepthCodecError::Foreign)?;
    if magic != MAGIC {
        return Err(DepthCodecError::Foreign);
    }
    let cut = || DepthCodecError::Damaged("the header is cut off".to_string());
    let (width, rest) = rest.split_first_chunk::<4>().ok_or_else(cut)?;
    let (height, _) = rest.split_first_chunk::<4>().ok_or_else(cut)?;
    let (width, height) = (u32::from_le_bytes(*width), u32::from_le_bytes(*height));
    pixel_count(width, height)?;
    Ok((width, height))
}

/// Unpacks an image; the exact inverse of [`encode`].
///
/// # Errors
/// [`DepthCodecError`] for anything that [`encode`] did not write.
pub fn decode(bytes: &[u8]) -> Result<DepthImage, DepthCodecError> {
    let (width, height) = size(bytes)?;
    let count = pixel_count(width, height)?;
    let packed = bytes.get(HEADER_LENGTH..).unwrap_or_default();
    let planes = zstd::bulk::decompress(packed, 2 * count).map_err(|e| DepthCodecError::Damaged(e.to_string()))?;
    if planes.len() != 2 * count {
        return Err(DepthCodecError::Damaged(format!("{} bytes instead of {}", planes.len(), 2 * count)));
    }
    Ok(DepthImage { width, height, values: from_planes(&planes, width as usize) })
}

fn size_error(width: u32, height: u32, count: usize) -> DepthCodecError {
    DepthCodecError::Size { width, height, count }
}

fn pixel_count(width: u32, height: u32) -> Result<usize, DepthCodecError> {
    let count = u64::from(width) * u64::from(height);
    if count == 0 || count > MAX_PIXELS {
        return Err(size_error(width, height, 0));
    }
    usize::try_from(count).map_err(|_| size_error(width, height, 0))
}

fn to_planes(values: &[u16], width: usize) -> Vec<u8> {
    let mut planes = vec![0_u8; 2 * values.len()];
    let (low, high) = planes.split_at_mut(values.len());
    let mut above = 0_u16;
    let rows = values.chunks_exact(width).zip(low.chunks_exact_mut(width)).zip(high.chunks_exact_mut(width));
    for ((row, low), high) in rows {
        let mut left = above;
        above = row[0];
        for ((&value, low), high) in row.iter().zip(low).zip(high) {
            let [l, h] = zigzag(value.wrapping_sub(left)).to_le_bytes();
            (*low, *high) = (l, h);
            left = value;
        }
    }
    planes
}

fn from_planes(planes: &[u8], width: usize) -> Vec<u16> {
    let (low, high) = planes.split_at(planes.len() / 2);
    let mut values = Vec::with_capacity(low.len());
    let mut above = 0_u16;
    for (low, high) in low.chunks_exact(width).zip(high.chunks_exact(width)) {
        let mut left = above;
        for (column, (&l, &h)) in low.iter().zip(high).enumerate() {
            left = left.wrapping_add(unzigzag(u16::from_le_bytes([l, h])));
            if column == 0 {
                above = left;
            }
            values.push(left);
        }
    }
    values
}

/// Small differences of either sign become small codes.
#[inline]
fn zigzag(difference: u16) -> u16 {
    (difference << 1) ^ (((difference as i16) >> 15) as u16)
}

#[inline]
fn unzigzag(code: u16) -> u16 {
    (code >> 1) ^ (code & 1).wrapping_neg()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn image(width: u32, height: u32, values: Vec<u16>) -> DepthImage {
        DepthImage { width, height, values }
    }

    #[test]
    fn known_bytes_of_two_by_two() {
        // By hand from the table in this module's documentation: 5; 4-5=-1 -> 1; 7-5=2 -> 4; 0-7=-7 -> 13.
        assert_eq!(to_planes(&[5, 4, 7, 0], 2), [10, 1, 4, 13, 0, 0, 0, 0]);
        let bytes = encode(&image(2, 2, vec![5, 4, 7, 0])).unwrap();
        assert_eq!(&bytes[..12], b"TDZ1\x02\0\0\0\x02\0\0\0");
        assert_eq!(zstd::decode_all(&bytes[12..]).unwrap(), [10, 1, 4, 13, 0, 0, 0, 0]);
    }

    #[test]
    fn refuses_wrong_sizes_and_every_truncation() {
        assert!(matches!(encode(&image(2, 2, vec![1; 3])), Err(DepthCodecError::Size { .. })));
        assert!(matches!(encode(&image(0, 2, vec![])), Err(DepthCodecError::Size { .. })));
        let values = (0..600).map(|i| (i * i % 977) as u16).collect();
        let bytes = encode(&image(30, 20, values)).unwrap();
        for length in 0..bytes.len() {
            assert!(decode(&bytes[..length]).is_err(), "{length} of {} bytes were accepted", bytes.len());
        }
        let mut huge = bytes.clone();
        huge[4..12].copy_from_slice(&[0xff; 8]);
        assert!(matches!(decode(&huge), Err(DepthCodecError::Size { .. })));
        let mut taller = bytes;
        taller[8] += 1;
        assert!(decode(&taller).is_err(), "a size that does not fit the data was accepted");
    }

    proptest! {
        #[test]
        fn round_trip(width in 1_u32..40, height in 1_u32..40, seed in any::<u64>()) {
            let mut state = seed | 1;
            let values = (0..width * height).map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                (state >> 48) as u16
            }).collect();
            let before = image(width, height, values);
            prop_assert_eq!(decode(&encode(&before).unwrap()).unwrap(), before);
        }

        #[test]
        fn garbage_never_panics(bytes in proptest::collection::vec(any::<u8>(), 0..200), at in 0_usize..60, flip in 1_u8..=255) {
            let _ = decode(&bytes);
            let mut damaged = encode(&image(6, 5, (0..30).collect())).unwrap();
            if let Some(byte) = damaged.get_mut(at) { *byte ^= flip; }
            let _ = decode(&damaged);
        }
    }
}
