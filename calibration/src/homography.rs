//! The map of a plane to a picture.

use nalgebra::{DMatrix, Matrix3, Point2};

/// The homography that maps points of a plane to pixels (direct linear transformation with normalised coordinates, Hartley
/// and Zisserman 2003, algorithm 4.2). `None` where the points do not determine one.
pub(crate) fn homography(plane: &[Point2<f64>], pixels: &[Point2<f64>]) -> Option<Matrix3<f64>> {
    if plane.len() < 4 || plane.len() != pixels.len() {
        return None;
    }
    let (from, to) = (normaliser(plane)?, normaliser(pixels)?);
    let mut rows = DMatrix::<f64>::zeros(2 * plane.len().max(5), 9);
    for (k, (p, q)) in plane.iter().zip(pixels).enumerate() {
        let p = from * p.to_homogeneous();
        let q = to * q.to_homogeneous();
        for i in 0..3 {
            rows[(2 * k, 3 + i)] = -p[i];
            rows[(2 * k, 6 + i)] = q.y * p[i];
            rows[(2 * k + 1, i)] = p[i];
            rows[(2 * k + 1, 6 + i)] = -q.x * p[i];
        }
    }
    let least = smallest_direction(rows)?;
    let h = Matrix3::from_row_slice(&least);
    let map = to.try_inverse()? * h * from;
    (map[(2, 2)].abs() > 1e-12).then(|| map / map[(2, 2)])
}

/// The unit vector that a matrix maps to the shortest one.
pub(crate) fn smallest_direction(rows: DMatrix<f64>) -> Option<Vec<f64>> {
    let svd = rows.svd(false, true);
    let least = svd.singular_values.imin();
    svd.v_t.map(|v| v.row(least).iter().copied().collect())
}

/// Moves points to their mean and scales them to a mean distance of √2.
fn normaliser(points: &[Point2<f64>]) -> Option<Matrix3<f64>> {
    let mean = points.iter().map(|p| p.coords).sum::<nalgebra::Vector2<f64>>() / points.len() as f64;
    let spread = points.iter().map(|p| (p.coords - mean).norm()).sum::<f64>() / points.len() as f64;
    let scale = 2f64.sqrt() / spread;
    scale.is_finite().then(|| Matrix3::new(scale, 0.0, -scale * mean.x, 0.0, scale, -scale * mean.y, 0.0, 0.0, 1.0))
}

/// A point through a homography.
pub(crate) fn mapped(h: &Matrix3<f64>, p: &Point2<f64>) -> Point2<f64> {
    let q: nalgebra::Vector3<f64> = h * p.to_homogeneous();
    Point2::new(q.x / q.z, q.y / q.z)
}
