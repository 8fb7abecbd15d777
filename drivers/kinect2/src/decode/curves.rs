//! Exponential, logarithm and angle in plain arithmetic, so that loops over rows become vector code and give the same
//! bits on every machine. Absolute errors are far below the sensor's noise.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, LN_2, PI, TAU};

/// e^x for −8 ≤ x ≤ 0, to 2e-5 of it; NaN of NaN. Taylor's series of degree six of the eighth root, around its middle.
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    const MIDDLE: f32 = -0.5;
    const EXP_MIDDLE: f32 = 0.606_530_66;
    let y = x * 0.125 - MIDDLE;
    let series =
        1.0 + y * (1.0 + y * (1.0 / 2.0 + y * (1.0 / 6.0 + y * (1.0 / 24.0 + y * (1.0 / 120.0 + y * (1.0 / 720.0))))));
    let root = EXP_MIDDLE * series;
    let quarter = root * root;
    let half = quarter * quarter;
    half * half
}

/// ln x for normal x > 0, to 1e-6: the exponent, and the series of the inverse hyperbolic tangent for the mantissa.
#[inline(always)]
pub fn ln(x: f32) -> f32 {
    /// Bits of √½: mantissas are taken from there to √2.
    const ROOT_HALF: i32 = 0x3f35_04f3;
    let bits = x.to_bits() as i32 - ROOT_HALF;
    let (exponent, mantissa) = (bits >> 23, f32::from_bits(((bits & 0x007f_ffff) + ROOT_HALF) as u32));
    let f = (mantissa - 1.0) / (mantissa + 1.0);
    let ff = f * f;
    let series = 1.0 + ff * (1.0 / 3.0 + ff * (1.0 / 5.0 + ff * (1.0 / 7.0)));
    exponent as f32 * LN_2 + 2.0 * f * series
}

/// Angle of (x, y) in 0..2π, to 3e-7; 0 of (0, 0) and of NaN. The polynomial is that of Cephes' `atanf`.
#[inline(always)]
pub fn angle(x: f32, y: f32) -> f32 {
    const TAN_PI_8: f32 = 0.414_213_57;
    let (ax, ay) = (x.abs(), y.abs());
    let steep = ay > ax;
    let (low, high) = if steep { (ax, ay) } else { (ay, ax) };
    let upper = low > TAN_PI_8 * high;
    let (numerator, denominator) = if upper { (low - high, low + high) } else { (low, high) };
    let t = if denominator > 0.0 { numerator / denominator } else { 0.0 };
    let z = t * t;
    let arc = (((8.053_744_5e-2 * z - 1.387_768_6e-1) * z + 1.997_771_1e-1) * z - 3.333_295e-1) * z * t + t;
    let octant = if upper { FRAC_PI_4 + arc } else { arc };
    let quadrant = if steep { FRAC_PI_2 - octant } else { octant };
    let half = if x < 0.0 { PI - quadrant } else { quadrant };
    if y < 0.0 { TAU - half } else { half }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_follow_the_standard_library() {
        for i in 0..=8000 {
            let x = -0.001 * i as f32;
            assert!((exp(x) / x.exp() - 1.0).abs() < 2e-5, "exp {x}");
            let x = 1e-3 * 1.003_f32.powi(i);
            if x < 1e9 {
                assert!((ln(x) - x.ln()).abs() < 1e-6 * x.ln().abs().max(1.0), "ln {x}");
            }
        }
        assert!(exp(f32::NAN).is_nan());
    }

    #[test]
    fn angles_go_once_round() {
        for i in 0..10_000 {
            let truth = TAU * i as f32 / 10_000.0;
            for size in [1e-6, 1.0, 3e4] {
                let (sin, cos) = truth.sin_cos();
                let found = angle(size * cos, size * sin);
                let apart = (found - truth).abs();
                assert!(apart.min(TAU - apart) < 1e-6 && (0.0..=TAU).contains(&found), "{truth}: {found}");
            }
        }
        assert_eq!((angle(0.0, 0.0), angle(5.0, 0.0)), (0.0, 0.0));
        assert!((angle(-1.0, 0.0) - PI).abs() < 1e-6);
    }
}
