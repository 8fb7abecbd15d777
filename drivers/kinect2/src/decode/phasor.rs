//! Three measurements of one frequency to a phasor: its angle is the light's delay, its length the amount of light.
//!
//! After US patent 8,587,771 B2 as libfreenect2 computes it (`src/cpu_depth_packet_processor.cpp`,
//! `processMeasurementTriple`): the measurements are of shutters 0, 120 and 240 degrees behind the light, and the table P0
//! has the delay of each pixel's own electronics.

use super::{Row, lut::SATURATED};

/// Shutters at 120 and 240 degrees: cosine −1/2, sine ±√3/2.
const SIN_120: f32 = 0.866_025_4;
/// Amount of light that a phasor's length stands for (libfreenect2 `depth_packet_processor.cpp`, `ab_multiplier`).
pub const LIGHT_PER_LENGTH: f32 = 0.666_666_7;
/// Light of a pixel that is beyond the sensor's range.
const SATURATED_LIGHT: f32 = 65_535.0;

/// One row of phasors of one frequency.
#[derive(Clone)]
pub struct PhasorRow {
    /// Along the delay of zero, and a quarter of a period after it.
    pub a: Row<f32>,
    /// See `a`.
    pub b: Row<f32>,
    /// The same of length one; NaN where the phasor is zero.
    pub unit_a: Row<f32>,
    /// See `unit_a`.
    pub unit_b: Row<f32>,
    /// Square of the length.
    pub square: Row<f32>,
}

impl Default for PhasorRow {
    fn default() -> Self {
        let zero = [0.0; super::COLUMNS];
        Self { a: zero, b: zero, unit_a: zero, unit_b: zero, square: zero }
    }
}

/// Phasors of a row, and its light added to `light`. `cos` and `sin` are of P0, times the frequency's gain.
#[inline(always)]
pub fn phasor_row(
    measured: &[Row<i16>; 3],
    (cos, sin): (&Row<f32>, &Row<f32>),
    out: &mut PhasorRow,
    light: &mut Row<f32>,
) {
    for x in 0..super::COLUMNS {
        let raw = [measured[0][x], measured[1][x], measured[2][x]];
        let saturated = raw[0] == SATURATED || raw[1] == SATURATED || raw[2] == SATURATED;
        let m = raw.map(f32::from);
        let (along, across) = (m[0] - 0.5 * (m[1] + m[2]), SIN_120 * (m[1] - m[2]));
        let a = cos[x] * along - sin[x] * across;
        let b = -(sin[x] * along + cos[x] * across);
        let (a, b) = if saturated { (0.0, 0.0) } else { (a, b) };
        let square = a * a + b * b;
        let length = square.sqrt();
        let inverse = 1.0 / length;
        out.a[x] = a;
        out.b[x] = b;
        out.unit_a[x] = a * inverse;
        out.unit_b[x] = b * inverse;
        out.square[x] = square;
        light[x] += if saturated { SATURATED_LIGHT } else { LIGHT_PER_LENGTH * length };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decode::{COLUMNS, curves::angle};

    #[test]
    fn a_phasor_has_the_delay_and_the_light_of_its_measurements() {
        let (p0, phase, light) = (-1.1_f32, 2.3_f32, 900.0_f32);
        let shutter = |k: usize| (light * (phase + p0 + k as f32 * 2.094_395).cos()).round() as i16;
        let measured = [0, 1, 2].map(|k| [shutter(k); COLUMNS]);
        let (cos, sin) = ([p0.cos(); COLUMNS], [p0.sin(); COLUMNS]);
        let (mut row, mut seen) = (PhasorRow::default(), [0.0; COLUMNS]);
        phasor_row(&measured, (&cos, &sin), &mut row, &mut seen);
        assert!((angle(row.a[7], row.b[7]) - phase).abs() < 1e-3);
        assert!((seen[7] - light).abs() < 1.0, "{}", seen[7]);
        let saturated = [measured[0], [SATURATED; COLUMNS], measured[2]];
        phasor_row(&saturated, (&cos, &sin), &mut row, &mut seen);
        assert_eq!((row.a[7], row.square[7]), (0.0, 0.0));
        assert!(seen[7] > 65_535.0 && row.unit_a[7].is_nan());
    }
}
