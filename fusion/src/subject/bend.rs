//! Whether the floor is seen bent, as through a lens whose distortion the calibration does not have.

use nalgebra::{Matrix5, Point3, SMatrix, SVector, Vector5};

/// Fewer points than this say nothing.
const MIN_POINTS: usize = 200;
/// The lens must explain at least this share of what is left of the floor's points beside their plane: stones and rugs bend
/// a floor too, but not along the square of the distance from the picture's centre.
const EXPLAINED: f64 = 0.5;

/// How far the first two radial coefficients of a lens would bend the points of a plane (camera frame, metres) as they are
/// seen, root mean square, metres; 0 where they do not explain how the points lie.
///
/// Inverse depth is linear in the rays of a plane. Rays that should be longer by k₁r² + k₂r⁴ add those shares of the
/// plane's slope along the ray: least squares of five unknowns.
pub(crate) fn bend_of(points: &[Point3<f64>]) -> f64 {
    if points.len() < MIN_POINTS {
        return 0.0;
    }
    let ray = |p: &Point3<f64>| [p.x / p.z, p.y / p.z];
    let flat = |p: &Point3<f64>| SVector::<f64, 3>::new(ray(p)[0], ray(p)[1], 1.0);
    let Some(plane) = solve_plane(points, flat) else { return 0.0 };
    let row = |p: &Point3<f64>| {
        let [x, y] = ray(p);
        let (square, slope) = (x * x + y * y, plane[0] * x + plane[1] * y);
        Vector5::new(x, y, 1.0, square * slope, square * square * slope)
    };
    let (mut normal, mut right) = (Matrix5::zeros(), Vector5::zeros());
    for p in points {
        let r = row(p);
        normal += r * r.transpose();
        right += r / p.z;
    }
    let Some(bent) = normal.cholesky().map(|c| c.solve(&right)) else { return 0.0 };
    // Depths: an error of inverse depth counts by the square of the depth.
    let left = |found: f64, p: &Point3<f64>| ((1.0 / p.z - found) * p.z * p.z).powi(2);
    let before: f64 = points.iter().map(|p| left(flat(p).dot(&plane), p)).sum();
    let after: f64 = points.iter().map(|p| left(row(p).dot(&bent), p)).sum();
    if after > (1.0 - EXPLAINED) * before { 0.0 } else { ((before - after) / points.len() as f64).sqrt() }
}

fn solve_plane(points: &[Point3<f64>], row: impl Fn(&Point3<f64>) -> SVector<f64, 3>) -> Option<SVector<f64, 3>> {
    let (mut normal, mut right) = (SMatrix::<f64, 3, 3>::zeros(), SVector::<f64, 3>::zeros());
    for p in points {
        let r = row(p);
        normal += r * r.transpose();
        right += r / p.z;
    }
    normal.cholesky().map(|c| c.solve(&right))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of a floor as a camera 1 m above it sees them that takes rays for shorter by `bend`.
    fn floor(bend: impl Fn(f64) -> f64) -> Vec<Point3<f64>> {
        let ray = |i: usize| [(i % 60) as f64 / 60.0 - 0.5, 0.3 + (i / 60) as f64 / 100.0];
        let seen = |i: usize| {
            let [x, y] = ray(i);
            let z = 1.0 / (y * bend(x * x + y * y));
            // A millimetre of unevenness here and there.
            Point3::new(x, y, 1.0) * (z + 0.001 * ((i * 7919) % 13) as f64 / 13.0)
        };
        (0..1800).map(seen).collect()
    }

    #[test]
    fn a_lens_that_is_not_told_bends_the_floor_and_a_flat_one_does_not() {
        assert_eq!(bend_of(&floor(|_| 1.0)), 0.0);
        let bent = bend_of(&floor(|r2| 1.0 - 0.09 * r2 + 0.27 * r2 * r2));
        assert!(bent > 0.003, "{bent}");
        assert_eq!(bend_of(&floor(|_| 1.0)[..100]), 0.0);
    }
}
