//! Depth and light to what the sensor measures: the inverse of libfreenect2's `src/cpu_depth_packet_processor.cpp`,
//! written from its formulas.
//!
//! A point whose light's way is D units of 0.625 m delays the light by D / 3, D / 15 and D / 2 periods at 80, 16 and
//! 120 MHz. Each frequency is measured by three shutters a third of a period apart.

use std::f64::consts::{PI, TAU};

use super::{IMAGE_BYTES, Optics, SIZE};

/// Periods of the three frequencies in units of the light's way, and their gains.
const PERIOD: [f64; 3] = [3.0, 15.0, 2.0];
const GAIN: [f64; 3] = [1.322_581, 1.0, 1.612_903];
/// Millimetres of ten thirds of a unit.
const UNIT_MM: f64 = 6250.0 / 3.0;
/// Strength of the parallax between light and lens.
const PARALLAX: f64 = 90.0;
/// Beyond this a measurement is saturated.
const MAX_MEASUREMENT: f64 = 16_352.0;

/// The depth and the light of one pixel.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Lit {
    /// Depth along +Z, metres; 0: nothing, no light comes back.
    pub z: f64,
    /// Light that comes back.
    pub light: f64,
}

/// A depth packet: ten images, mirrored as the sensor sees. `noise` gives what is added to measurement k (0..9) of pixel i.
pub fn packet(optics: &Optics, seen: &[Lit], noise: impl Fn(usize, usize) -> f64) -> Vec<u8> {
    let phasors = phasors(optics, seen);
    let mut bytes = vec![0; 10 * IMAGE_BYTES];
    for (image, out) in bytes.chunks_exact_mut(IMAGE_BYTES).take(9).enumerate() {
        let (f, shutter) = (image / 3, (image % 3) as f64 * TAU / 3.0);
        for (i, phasor) in phasors.iter().enumerate() {
            let (u, v) = (i % SIZE.0, i / SIZE.0);
            let column = SIZE.0 - 1 - u;
            let behind = shutter - f64::from(Optics::p0(f, column, v)) * 0.000_031 * PI;
            let (sin, cos) = behind.sin_cos();
            let measured = (phasor[f][0] * cos - phasor[f][1] * sin) / GAIN[f] + noise(i, image);
            put(out, column, packet_row(v), code(measured));
        }
    }
    bytes
}

/// Per pixel and frequency the light with its delay, blurred a little by the lens, so that edges mix both sides.
fn phasors(optics: &Optics, seen: &[Lit]) -> Vec<[[f64; 2]; 3]> {
    let rays = optics.depth.rays();
    let sharp: Vec<[[f64; 2]; 3]> = seen
        .iter()
        .zip(&rays)
        .map(|(pixel, ray)| {
            let way = way(ray.map(f64::from), 1000.0 * pixel.z);
            PERIOD.map(|period| {
                let (sin, cos) = (TAU * way / period).sin_cos();
                [pixel.light * cos, pixel.light * sin]
            })
        })
        .collect();
    let (width, height) = SIZE;
    let blurred = |i: usize| {
        let (u, v) = (i % width, i / width);
        if u == 0 || v == 0 || u == width - 1 || v == height - 1 {
            return sharp[i];
        }
        std::array::from_fn(|f| {
            std::array::from_fn(|k| {
                let around = [i - 1, i + 1, i - width, i + width].iter().map(|&j| sharp[j][f][k]).sum::<f64>();
                0.88 * sharp[i][f][k] + 0.03 * around
            })
        })
    };
    (0..sharp.len()).map(blurred).collect()
}

/// Way of the light in units, of a pixel with this ray and depth; 0 where there is nothing.
fn way([x, y]: [f64; 2], z_mm: f64) -> f64 {
    if z_mm <= 0.0 {
        return 0.0;
    }
    let along = UNIT_MM / (1.0 + x * x + y * y).sqrt();
    // The stated image is mirrored: its columns grow towards −x.
    let parallax = -x * along * PARALLAX / (2.0 * UNIT_MM).powi(2);
    let range = (z_mm + (z_mm * z_mm - 4.0 * along * z_mm * parallax).max(0.0).sqrt()) / (2.0 * along);
    range / 0.3
}

/// Row of a packet's image for row `v`: the lower half is upside down.
fn packet_row(v: usize) -> usize {
    if v < 212 { v } else { 635 - v }
}

/// Eleven bits: a sign, three bits of exponent, seven of mantissa.
fn code(measured: f64) -> u16 {
    let size = measured.abs();
    if size > MAX_MEASUREMENT {
        return 1024;
    }
    let step = (0..7).find(|step| size / f64::from(1 << step) < 255.5).unwrap_or(6);
    let rounded = (size / f64::from(1 << step)).round() as u16;
    let magnitude = if step == 0 { rounded } else { (step + 1) << 7 | (rounded & 127) };
    // A negative zero would mean saturation.
    if measured < 0.0 && magnitude > 0 { magnitude | 1024 } else { magnitude }
}

/// Writes eleven bits where the sensor has them: a row is four quarters, each with every fourth column.
fn put(image: &mut [u8], column: usize, row: usize, code: u16) {
    let at = 11 * ((column >> 2) + ((column & 3) << 7));
    let start = row * (SIZE.0 * 11 / 8) + at / 8;
    let bits = u32::from(code) << (at % 8);
    for (byte, bits) in image[start..].iter_mut().zip(bits.to_le_bytes()).take((at % 8 + 11).div_ceil(8)) {
        *byte |= bits;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_stand_for_the_nearest_step() {
        // Values of libfreenect2's table: it counts up in steps of 1, 1, 2, 4, ...
        let mut table = vec![0.0];
        for code in 0..1023 {
            table.push(table[code] + f64::from(1 << (code / 128 - usize::from(code >= 128))));
        }
        for tenths in 0..163_000 {
            let value = 0.1 * f64::from(tenths);
            let off = (table[usize::from(code(value))] - value).abs();
            let best = table.iter().map(|t| (t - value).abs()).fold(f64::MAX, f64::min);
            if tenths % 97 == 0 {
                assert!(off <= best + 1e-9, "{value}: off {off}, best {best}");
            }
        }
        assert_eq!((code(20_000.0), code(-20_000.0), code(-0.2), code(-3.0)), (1024, 1024, 0, 1027));
    }

    #[test]
    fn the_way_is_twice_the_distance_on_the_axis() {
        assert!((way([0.0, 0.0], 625.0) - 1.0).abs() < 1e-12);
        assert_eq!(way([0.3, 0.1], 0.0), 0.0);
        assert!((way([0.0, 0.75], 625.0) - 1.25).abs() < 1e-12);
    }
}
