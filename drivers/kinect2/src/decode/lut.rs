//! Eleven packed bits to measurements.
//!
//! A measurement is a small float: a sign, three bits of exponent and seven of mantissa (libfreenect2
//! `src/libfreenect2.cpp`, `IrCameraTables`, whose table counts up in steps of 1, 1, 2, 4, ... 64). A row of 512 stands in
//! four quarters of 128: column 4k + j is value k of quarter j; values stand the lowest bit first without gaps
//! (libfreenect2 `src/opencl_depth_packet_processor.cl`, `decodePixelMeasurement`).

use super::{COLUMNS, Row};

/// Bytes of a row, and of a quarter of it.
pub const ROW_BYTES: usize = COLUMNS * 11 / 8;
const QUARTER_BYTES: usize = ROW_BYTES / 4;
/// The value of a measurement beyond the sensor's range: a negative zero.
pub const SATURATED: i16 = i16::MAX;

/// The measurement of every eleven bits.
pub fn lut() -> [i16; 2048] {
    std::array::from_fn(|code| {
        let (exponent, mantissa) = (code as i16 >> 7 & 7, code as i16 & 127);
        let size = if exponent == 0 { mantissa } else { (mantissa | 128) << (exponent - 1) };
        match (code >= 1024, size) {
            (true, 0) => SATURATED,
            (true, size) => -size,
            (false, size) => size,
        }
    })
}

/// Unpacks a row; the sensor sees mirrored, so the first column comes last. The two outermost columns hold no image.
#[inline(always)]
pub fn unpack_row(bytes: &[u8; ROW_BYTES], lut: &[i16; 2048], out: &mut Row<i16>) {
    let (quarters, _) = bytes.as_chunks::<QUARTER_BYTES>();
    let (blocks, _) = out.as_chunks_mut::<32>();
    for (group, block) in blocks.iter_mut().rev().enumerate() {
        for (j, quarter) in quarters.iter().enumerate() {
            let (groups, _) = quarter.as_chunks::<11>();
            let eight = eight(&groups[group]);
            for (k, code) in eight.into_iter().enumerate() {
                block[31 - 4 * k - j] = lut[code & 2047];
            }
        }
    }
    (out[0], out[COLUMNS - 1]) = (0, 0);
}

/// Eight values of eleven bytes, with higher bits still on.
#[inline(always)]
fn eight(bytes: &[u8; 11]) -> [usize; 8] {
    let [b0, b1, b2, b3, b4, b5, b6, b7, b8, b9, b10] = *bytes;
    let low = u64::from_le_bytes([b0, b1, b2, b3, b4, b5, b6, b7]);
    let high = u64::from_le_bytes([b3, b4, b5, b6, b7, b8, b9, b10]);
    let low_bits = [0, 11, 22, 33, 44].map(|at| (low >> at) as usize);
    let high_bits = [55 - 24, 66 - 24, 77 - 24].map(|at| (high >> at) as usize);
    [low_bits[0], low_bits[1], low_bits[2], low_bits[3], low_bits[4], high_bits[0], high_bits[1], high_bits[2]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_counts_up_in_steps_that_double() {
        let lut = lut();
        // Written as libfreenect2 writes it.
        let mut value = 0;
        for x in 0..1024_usize {
            assert_eq!(lut[x], value, "{x}");
            assert_eq!(lut[1024 + x], if x == 0 { SATURATED } else { -value }, "{x}");
            value += 1 << (x / 128 - usize::from(x >= 128));
        }
    }

    #[test]
    fn a_row_is_unpacked_as_bit_by_bit() {
        let bytes: [u8; ROW_BYTES] = std::array::from_fn(|i| (i * 151 + i * i / 7) as u8);
        let lut = lut();
        let mut row = [0; COLUMNS];
        unpack_row(&bytes, &lut, &mut row);
        for x in 1..511 {
            let at = ((x >> 2) + ((x & 3) << 7)) * 11;
            let code = (0..11).map(|b| usize::from(bytes[(at + b) / 8] >> ((at + b) % 8) & 1) << b).sum::<usize>();
            assert_eq!(row[511 - x], lut[code], "{x}");
        }
        assert_eq!((row[0], row[511]), (0, 0));
    }
}
