//! Census transform: each pixel as the signs of brightness differences around it, which neither exposure nor gain of
//! a camera changes (Zabih & Woodfill 1994), in the centre-symmetric form of Spangenberg et al. 2013: the pixel across
//! the centre is the partner of each, so that 7×7 pixels give 24 bits. Of 9×7 (31 bits), 9×5 and 7×7, the last had the fewest
//! wrong pixels on real pairs and is the cheapest.

use crate::GrayImage;

/// Bytes of a signature.
pub(crate) const PLANES: usize = 3;

/// Largest Hamming distance of two signatures.
pub(crate) const BITS: u8 = 24;

/// Half width and half height of the window.
const HALF: (usize, usize) = (3, 3);

/// Signatures of a whole image; each row holds its byte planes one after the other, so that a vector register takes
/// the same byte of neighbouring pixels.
pub(crate) struct Census {
    /// Bytes of a plane of a row.
    width: usize,
    bytes: Vec<u8>,
}

impl Census {
    /// The byte planes of row `v`.
    #[inline(always)]
    pub fn planes(&self, v: usize) -> [&[u8]; PLANES] {
        let row = &self.bytes[v * PLANES * self.width..][..PLANES * self.width];
        let mut planes = [row; PLANES];
        for (plane, bytes) in planes.iter_mut().zip(row.chunks_exact(self.width)) {
            *plane = bytes;
        }
        planes
    }
}

/// Signatures of `rows` of an image (pixels beyond its border repeat the nearest). With `mirrored` each row runs from
/// right to left and has `margin` zeros behind it.
#[inline(always)]
pub(crate) fn transform(image: &GrayImage, rows: std::ops::Range<usize>, mirrored: bool, margin: usize) -> Census {
    let (w, h) = (image.width as usize, image.height as usize);
    let width = w + margin;
    let mut bytes = vec![0; rows.len() * PLANES * width];
    let padded_row = w + 2 * HALF.0;
    let mut window = vec![0u8; (2 * HALF.1 + 1) * padded_row];
    for (out, v) in bytes.chunks_exact_mut(PLANES * width).zip(rows) {
        for (k, line) in window.chunks_exact_mut(padded_row).enumerate() {
            pad(image.row((v + k).saturating_sub(HALF.1).min(h - 1)), line, mirrored);
        }
        signatures(&window, padded_row, mirrored, out, width);
    }
    Census { width, bytes }
}

/// Copies a row, its ends repeated.
#[inline(always)]
fn pad(row: &[u8], line: &mut [u8], mirrored: bool) {
    let inner = &mut line[HALF.0..][..row.len()];
    inner.copy_from_slice(row);
    if mirrored {
        inner.reverse();
    }
    let (first, last) = (inner[0], inner[row.len() - 1]);
    line[..HALF.0].fill(first);
    line[HALF.0 + row.len()..].fill(last);
}

/// The signatures of one row from the rows around it. In mirrored rows the offsets are mirrored too, so that a bit means
/// the same in both.
#[inline(always)]
fn signatures(window: &[u8], padded_row: usize, mirrored: bool, out: &mut [u8], width: usize) {
    let columns = 2 * HALF.0 + 1;
    let w = padded_row - 2 * HALF.0;
    for bit in 0..BITS as usize {
        let (row, column) = (bit / columns, bit % columns);
        let column = if mirrored { 2 * HALF.0 - column } else { column };
        let pixel = &window[row * padded_row + column..][..w];
        let partner = &window[(2 * HALF.1 - row) * padded_row + 2 * HALF.0 - column..][..w];
        let plane = &mut out[bit / 8 * width..][..w];
        for ((byte, a), b) in plane.iter_mut().zip(pixel).zip(partner) {
            *byte |= u8::from(a < b) << (bit % 8);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::noise;

    /// Bits of pixel (x, y), looked up one by one.
    fn signature(image: &GrayImage, x: i64, y: i64) -> u32 {
        let at = |dx: i64, dy: i64| {
            let u = (x + dx).clamp(0, i64::from(image.width) - 1);
            let v = (y + dy).clamp(0, i64::from(image.height) - 1);
            image.row(v as usize)[u as usize]
        };
        let offset = |bit: i64| (bit % 7 - 3, bit / 7 - 3);
        (0..24).map(offset).enumerate().map(|(k, (dx, dy))| u32::from(at(dx, dy) < at(-dx, -dy)) << k).sum()
    }

    #[test]
    fn both_directions_agree_with_looking_up() {
        let image = noise(23, 11, 7);
        let plain = transform(&image, 2..9, false, 0);
        let mirrored = transform(&image, 2..9, true, 5);
        for v in 0..7 {
            for x in 0..23 {
                let [a, b, c, _] = signature(&image, x as i64, v as i64 + 2).to_le_bytes();
                let expected = [a, b, c];
                assert_eq!(plain.planes(v).map(|p| p[x]), expected, "{x} {v}");
                assert_eq!(mirrored.planes(v).map(|p| p[22 - x]), expected, "mirrored {x} {v}");
            }
            assert!(mirrored.planes(v).iter().all(|p| p.len() == 28 && p[23..] == [0; 5]));
        }
    }
}
