//! The part of the light that a turn does not show: how it changes from normals that look up to those that look down.
//!
//! A turn about the vertical axis leaves the height of a normal as it is, so that a brightness that depends on it alone looks like
//! the surface's own colour. But a surface's colour is constant for most short steps, where its shape is not (Land and McCann 1971):
//! neighbours that differ in height of their normals and in brightness show the light, and the few that lie on either side of a
//! print's edge are outvoted.

use nalgebra::{Matrix3, Point3, Vector3};

/// Neighbours are at most this far from each other, metres: less than a usual print is wide.
const NEAR: f32 = 0.045;
/// Smallest cosine between their normals: they are of one side of the body.
const ALIKE: f32 = 0.3;
/// Smallest difference of the heights of their normals.
const STEP: f32 = 0.05;
/// Difference in brightness, in logarithms, at which a pair counts half.
const SCALE: f64 = 0.06;
/// Rounds of reweighting.
const ROUNDS: usize = 30;
/// Pairs that a belief in even light counts as.
const PRIOR: f64 = 20.0;

/// A vertex: its place, its normal, and the logarithm of its brightness.
pub(crate) struct Sample {
    pub place: Point3<f32>,
    pub normal: Vector3<f32>,
    pub brightness: f64,
}

/// The first three Legendre polynomials of a height.
pub(crate) fn polynomials(height: f64) -> Vector3<f64> {
    let square = height * height;
    Vector3::new(height, 0.5 * (3.0 * square - 1.0), 0.5 * height * (5.0 * square - 3.0))
}

/// Factors of the polynomials of a normal's height that explain the brightness of neighbours.
pub(crate) fn solve(samples: &[Sample]) -> Vector3<f64> {
    let pairs = pairs(samples);
    let mut found = Vector3::zeros();
    for _ in 0..ROUNDS {
        let (mut matrix, mut right) = (Matrix3::identity() * PRIOR * STEP as f64, Vector3::zeros());
        for (row, difference) in &pairs {
            let weight = 1.0 / (1.0 + ((difference - row.dot(&found)) / SCALE).powi(2));
            matrix += weight * row * row.transpose();
            right += weight * row * *difference;
        }
        let Some(next) = matrix.cholesky().map(|c| c.solve(&right)) else { break };
        found = next;
    }
    found
}

/// Differences of the polynomials and of the brightness of all neighbours.
fn pairs(samples: &[Sample]) -> Vec<(Vector3<f64>, f64)> {
    let mut order: Vec<&Sample> = samples.iter().collect();
    order.sort_by(|a, b| a.place.y.total_cmp(&b.place.y));
    let mut pairs = Vec::new();
    for (i, a) in order.iter().enumerate() {
        for b in order[i + 1..].iter().take_while(|b| b.place.y - a.place.y < NEAR) {
            let is_pair = (a.place - b.place).norm() < NEAR
                && a.normal.dot(&b.normal) > ALIKE
                && (a.normal.y - b.normal.y).abs() > STEP;
            if is_pair {
                let row = polynomials(f64::from(a.normal.y)) - polynomials(f64::from(b.normal.y));
                pairs.push((row, a.brightness - b.brightness));
            }
        }
    }
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ball with a checkerboard of prints on it, brighter where it looks up.
    #[test]
    fn light_from_above_is_told_from_prints() {
        let golden = std::f32::consts::PI * (3.0 - 5.0f32.sqrt());
        let sample = |i: usize| {
            let y = 1.0 - 2.0 * (i as f32 + 0.5) / 3000.0;
            let (sin, cos) = (golden * i as f32).sin_cos();
            let normal = Vector3::new((1.0 - y * y).sqrt() * cos, y, (1.0 - y * y).sqrt() * sin);
            let place = Point3::from(normal * 0.3);
            let print = (place * 8.0).coords.iter().map(|c| c.floor() as i64).sum::<i64>().rem_euclid(2) as f64;
            Sample { place, normal, brightness: 0.4 * f64::from(y) + 1.2 * print }
        };
        let samples: Vec<Sample> = (0..3000).map(sample).collect();
        let found = solve(&samples);
        assert!((found - Vector3::new(0.4, 0.0, 0.0)).norm() < 0.04, "{found}");
    }
}
