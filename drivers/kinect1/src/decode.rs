//! Frames' bytes to images.

use toile_capture::RgbImage;

/// Columns of every image.
pub const WIDTH: usize = 640;
/// Rows of depth and colour.
pub const HEIGHT: usize = 480;
/// Rows of infrared (libfreenect `src/cameras.c`, mode `FREENECT_VIDEO_IR_10BIT`).
pub const INFRARED_HEIGHT: usize = 488;
/// Raw depth of pixels without depth, of eleven bits (libfreenect `include/libfreenect.h`).
pub const NO_DEPTH: u16 = 2047;

/// Bytes of `count` values of `bits` bits without gaps.
pub const fn packed_size(count: usize, bits: usize) -> usize {
    count * bits / 8
}

/// Values of `bits` (1 to 16) bits each, the highest bit first, without gaps (libfreenect `src/cameras.c`,
/// `convert_packed_to_16bit`). Bits that make no whole value are left.
pub fn unpack(bytes: &[u8], bits: u32) -> Vec<u16> {
    let mut values = Vec::with_capacity(bytes.len() * 8 / bits as usize);
    let (mut waiting, mut count) = (0u32, 0);
    for &byte in bytes {
        waiting = waiting << 8 | u32::from(byte);
        count += 8;
        while count >= bits {
            count -= bits;
            values.push((waiting >> count & ((1 << bits) - 1)) as u16);
        }
    }
    values
}

/// Raw depth of ten bits as that of eleven: the lowest bit is what it lacks, so 1023 means that there is no depth.
pub fn eleven_from_ten(raw: &mut [u16]) {
    raw.iter_mut().for_each(|value| *value = if *value >= 1023 { NO_DEPTH } else { *value << 1 });
}

/// Infrared of ten bits as grey.
pub fn grey(infrared: &[u16]) -> RgbImage {
    let pixels = infrared.iter().map(|&value| [(value >> 2) as u8; 3]).collect();
    RgbImage { width: WIDTH as u32, height: (infrared.len() / WIDTH) as u32, pixels }
}

/// Colours behind the Bayer filter to pixels, bilinear; `None` where the size is wrong.
///
/// Even rows are green, red, green, ...; odd rows blue, green, ... (libfreenect `src/cameras.c`,
/// `convert_bayer_to_rgb`). Beyond an edge the image is mirrored, which keeps the filter's order.
pub fn demosaic(bayer: &[u8]) -> Option<RgbImage> {
    if bayer.len() != WIDTH * HEIGHT {
        return None;
    }
    let mut pixels = vec![[0; 3]; bayer.len()];
    for (y, row) in pixels.chunks_exact_mut(WIDTH).enumerate() {
        let line = |y: usize| &bayer[y * WIDTH..][..WIDTH];
        let (above, below) = (line(if y == 0 { 1 } else { y - 1 }), line(if y + 1 == HEIGHT { y - 1 } else { y + 1 }));
        demosaic_row(row, [above, line(y), below], y % 2 == 0);
    }
    Some(RgbImage { width: WIDTH as u32, height: HEIGHT as u32, pixels })
}

fn demosaic_row(out: &mut [[u8; 3]], [above, here, below]: [&[u8]; 3], has_red: bool) {
    for (x, pixel) in out.iter_mut().enumerate() {
        let (left, right) = (if x == 0 { 1 } else { x - 1 }, if x + 1 == WIDTH { x - 1 } else { x + 1 });
        let mean = |values: [u8; 4]| ((values.iter().map(|&v| u32::from(v)).sum::<u32>() + 2) / 4) as u8;
        let across = mean([here[left], here[left], here[right], here[right]]);
        let along = mean([above[x], above[x], below[x], below[x]]);
        let cross = mean([here[left], here[right], above[x], below[x]]);
        let corners = mean([above[left], above[right], below[left], below[right]]);
        *pixel = match (has_red, x % 2 == 0) {
            (true, true) => [across, here[x], along],
            (true, false) => [here[x], cross, corners],
            (false, true) => [corners, cross, here[x]],
            (false, false) => [along, here[x], across],
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_stand_one_after_another() {
        // 11 bits: 10101010101 11111111111 and two left over.
        assert_eq!(unpack(&[0b1010_1010, 0b1011_1111, 0b1111_1100], 11), [0b101_0101_0101, 0b111_1111_1111]);
        // 10 bits: 0000000001 0000000010 0000000011 1111111111.
        assert_eq!(unpack(&[0b0000_0000, 0b0100_0000, 0b0010_0000, 0b0000_1111, 0xff], 10), [1, 2, 3, 1023]);
    }

    /// The filter of a pixel, from the picture in libfreenect's comment.
    fn filter(x: usize, y: usize) -> usize {
        [[1, 0], [2, 1]][y % 2][x % 2]
    }

    fn mosaic(color: impl Fn(usize, usize) -> [u8; 3]) -> Vec<u8> {
        (0..WIDTH * HEIGHT).map(|i| color(i % WIDTH, i / WIDTH)[filter(i % WIDTH, i / WIDTH)]).collect()
    }

    #[test]
    fn one_colour_stays_itself_everywhere() {
        let image = demosaic(&mosaic(|_, _| [200, 30, 90])).unwrap();
        assert!(image.pixels.iter().all(|p| *p == [200, 30, 90]));
        assert!(demosaic(&[0; 100]).is_none());
    }

    #[test]
    fn a_ramp_stays_a_ramp_within_and_what_was_measured_stays() {
        let ramp = |x: usize, y: usize| [(x / 4) as u8, (y / 4) as u8, ((x + y) / 8) as u8];
        let image = demosaic(&mosaic(ramp)).unwrap();
        for y in 1..HEIGHT - 1 {
            for x in 1..WIDTH - 1 {
                let (got, truth) = (image.pixels[y * WIDTH + x], ramp(x, y));
                assert_eq!(got[filter(x, y)], truth[filter(x, y)]);
                assert!((0..3).all(|c| got[c].abs_diff(truth[c]) <= 1), "{x} {y}: {got:?} {truth:?}");
            }
        }
    }

    #[test]
    fn ten_bits_are_eleven_without_the_lowest() {
        let mut raw = [1023, 0, 400];
        eleven_from_ten(&mut raw);
        assert_eq!(raw, [NO_DEPTH, 0, 800]);
    }
}
