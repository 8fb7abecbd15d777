//! Three delays of 80, 16 and 120 MHz to one distance.
//!
//! In units of 0.625 m the three repeat every 3, 15 and 2, so together every 30: 18.75 m. The parts of the periods that
//! were measured are brought to one distance, the three answers averaged, and what does not fit together is dropped
//! (libfreenect2 `src/cpu_depth_packet_processor.cpp`, `processPixelStage2`, which has rules and constants from the
//! vendor's shader).

use std::f32::consts::TAU;

use super::{
    COLUMNS, Row,
    curves::{angle, exp, ln},
    phasor::LIGHT_PER_LENGTH,
};

/// Minimum light of one frequency, and of all three together.
const MIN_LIGHT: f32 = 3.0;
const MIN_SUM: f32 = 10.0;
/// The more light, the better the three must fit: at most e^(a + b · ln light) apart, between two bounds
/// (`ab_confidence_offset` times 3.321928, `ab_confidence_slope`, `min_dealias_confidence`, `max_dealias_confidence`).
const MISFIT_OFFSET: f32 = 0.769_489_4 * std::f32::consts::LOG2_10;
const MISFIT_SLOPE: f32 = -0.533_057_8;
const MISFIT: [f32; 2] = [0.349_065_9, 0.610_865_3];
/// Direction in which the three answers lie when they agree: (80, 16, 120) MHz of length one.
const AGREE: [f32; 3] = [0.551_318, 0.110_264, 0.826_977];

/// The distances of a row's phasors.
pub struct Distances<'a> {
    /// Distance along the ray in units of 2083.333 mm; 0 where there is none.
    pub range: &'a mut Row<f32>,
    /// Light of the three together.
    pub light: &'a mut Row<f32>,
}

/// Unwraps a row: phasors of the three frequencies in the order of the packet (80, 16 and 120 MHz).
#[inline(always)]
pub fn unwrap_row(a: &[Row<f32>; 3], b: &[Row<f32>; 3], out: &mut Distances<'_>) {
    for x in 0..COLUMNS {
        let (a, b) = ([a[0][x], a[1][x], a[2][x]], [b[0][x], b[1][x], b[2][x]]);
        let delay = [angle(a[0], b[0]), angle(a[1], b[1]), angle(a[2], b[2])];
        let light = [length(a[0], b[0]), length(a[1], b[1]), length(a[2], b[2])];
        let sum = light[0] + light[1] + light[2];
        let (min, max) = (light[0].min(light[1]).min(light[2]), light[0].max(light[1]).max(light[2]));
        let (mean, misfit) = unwrap(delay);
        // ln of nothing is never asked for: what is too dark is dropped anyway.
        let most_misfit =
            (exp(MISFIT_OFFSET + MISFIT_SLOPE * ln(max.max(1.0)) - 3.0) * E_CUBED).clamp(MISFIT[0], MISFIT[1]);
        let fits = misfit <= most_misfit * most_misfit && mean >= 0.0;
        let bright = min >= MIN_LIGHT && sum >= MIN_SUM;
        out.range[x] = if fits && bright { mean } else { 0.0 };
        out.light[x] = sum;
    }
}

/// e³: takes [`exp`]'s argument below zero.
const E_CUBED: f32 = 20.085_537;

#[inline(always)]
fn length(a: f32, b: f32) -> f32 {
    (a * a + b * b).sqrt() * LIGHT_PER_LENGTH
}

/// Mean of the three answers as parts of ten thirds of a unit, and the square of how far they are apart.
#[inline(always)]
fn unwrap(delay: [f32; 3]) -> (f32, f32) {
    let t0 = delay[0] * (3.0 / TAU);
    let t1 = delay[1] * (15.0 / TAU);
    let t2 = delay[2] * (2.0 / TAU);
    // 16 MHz says in which period of 80 MHz it is.
    let by_80 = ((t1 - t0) * (1.0 / 3.0) + 0.5).floor() * 3.0 + t0;
    // 120 MHz says whether it is beyond the first 15 units.
    let apart = by_80 - t2;
    let half = 0.5 * apart.abs();
    let rest = (half - half.floor()) * 2.0;
    let beyond = if rest > 0.5 && rest < 1.5 { 15.0 } else { 0.0 };
    let (by_80, by_16) = (by_80 + beyond, t1 + beyond);
    let by_120 = ((by_80 - t2) * 0.5 + 0.5).floor() * 2.0 + t2;
    let turns = [by_80 * (1.0 / 3.0), by_16 * (1.0 / 15.0), by_120 * 0.5];
    let mean = (turns[0] + turns[1] + turns[2]) * (1.0 / 3.0);
    let phase = turns.map(|t| t * TAU);
    let cross = [
        phase[1] * AGREE[2] - phase[2] * AGREE[1],
        phase[2] * AGREE[0] - phase[0] * AGREE[2],
        phase[0] * AGREE[1] - phase[1] * AGREE[0],
    ];
    (mean, cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_distance_up_to_thirty_units_is_found_again() {
        for i in 1..3000 {
            let units = 0.01 * i as f32;
            let delay = [3.0, 15.0, 2.0].map(|period: f32| (units / period).fract() * TAU);
            let (mean, misfit) = unwrap(delay);
            assert!((mean - 0.3 * units).abs() < 1e-4, "{units}: {mean}");
            assert!(misfit < 1e-4, "{units}: {misfit}");
        }
    }

    #[test]
    fn delays_that_do_not_belong_together_misfit() {
        let delay = [3.0, 15.0, 2.0].map(|period: f32| (3.2_f32 / period).fract() * TAU);
        let (_, misfit) = unwrap([delay[0], delay[1], delay[2] + 1.2]);
        assert!(misfit > MISFIT[1] * MISFIT[1], "{misfit}");
    }
}
