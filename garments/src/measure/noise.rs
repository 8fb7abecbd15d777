//! How much heights and colours differ where nothing is new.

use toile_geometry::statistics::{Rank, median, quantile_by};

use super::body_parts::PART_COUNT;

/// Smallest scales that are believed, metres and colour units: no sensor is better.
const MIN_DISTANCE_NOISE: f32 = 0.0007;
const MIN_COLOR_NOISE: f32 = 1.5;
/// Largest scales that uncovered skin can explain, metres and colour units.
const MAX_DISTANCE_NOISE: f32 = 0.004;
const MAX_COLOR_NOISE: f32 = 8.0;
/// A part of the body needs this many vertices to be measured.
const PART_VERTICES: usize = 150;
/// The quantile of the parts' medians that is the noise.
const LOW: f64 = 0.3;

/// Scales of `height` (Laplacian, metres) and `color` (exponential) where nothing is new.
///
/// Some parts of the body are always uncovered, or covered as they were before, and posing is not equally good for all:
/// a low quantile over the parts' medians is the noise.
pub(super) fn noise(parts: &[[f32; PART_COUNT]], height: &[f32], color: &[f32]) -> [f32; 2] {
    // The median of |x| is ln 2 times the scale, for both distributions; parts differ, hence the half more.
    let scale = 1.5 / std::f32::consts::LN_2;
    let (height, color) = (low(parts, |v| height[v].abs()), low(parts, |v| color[v]));
    [
        (height * scale).clamp(MIN_DISTANCE_NOISE, MAX_DISTANCE_NOISE),
        (color * scale).clamp(MIN_COLOR_NOISE, MAX_COLOR_NOISE),
    ]
}

/// A low quantile of the parts' medians.
fn low(parts: &[[f32; PART_COUNT]], value: impl Fn(usize) -> f32) -> f32 {
    let mut medians: Vec<f32> = (0..PART_COUNT).filter_map(|part| median_of(parts, part, &value)).collect();
    quantile_by(&mut medians, LOW, Rank::Count).unwrap_or(0.0)
}

fn median_of(parts: &[[f32; PART_COUNT]], part: usize, value: impl Fn(usize) -> f32) -> Option<f32> {
    let of_part = (0..parts.len()).filter(|&v| parts[v][part] > 0.5);
    let mut values: Vec<f32> = of_part.map(value).filter(|x| x.is_finite()).collect();
    if values.len() < PART_VERTICES { None } else { median(&mut values) }
}
