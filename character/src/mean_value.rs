//! Mean value coordinates in a closed triangle mesh (Ju, Schaefer & Warren 2005, fig. 4): Hu et al. 2017, eq. 1.

use nalgebra::{Point3, Vector3};

/// Below this a spherical triangle's sine counts as zero: the point lies in the triangle's plane, outside the triangle.
const FLAT: f64 = 1e-10;

/// Weights of all vertices for `point`, strictly inside the closed mesh; they sum to 1 and reproduce every affine map.
///
/// A point nearer than 1 nm to a vertex takes that vertex alone. Cost: one pass over the triangles.
pub fn mean_value_weights(point: &Point3<f64>, positions: &[Point3<f64>], triangles: &[[u32; 3]]) -> Vec<f64> {
    let rays: Vec<(Vector3<f64>, f64)> = positions
        .iter()
        .map(|p| {
            let (ray, length) = (p - point, (p - point).norm());
            (ray / length.max(1e-9), length)
        })
        .collect();
    let mut weights = vec![0.0; positions.len()];
    if let Some(v) = rays.iter().position(|r| r.1 < 1e-9) {
        weights[v] = 1.0;
        return weights;
    }
    for t in triangles {
        let corners = t.map(|v| rays[v as usize]);
        if let Some(add) = triangle_weights(corners) {
            (0..3).for_each(|k| weights[t[k] as usize] += add[k]);
        }
    }
    let sum: f64 = weights.iter().sum();
    if sum.abs() > 0.0 {
        weights.iter_mut().for_each(|w| *w /= sum);
    }
    weights
}

/// One triangle's share for its three corners, given unit rays and distances; `None` where its plane holds the point.
fn triangle_weights(corners: [(Vector3<f64>, f64); 3]) -> Option<[f64; 3]> {
    let [a, b, c] = corners.map(|x| x.0);
    let chord = [(b - c).norm(), (c - a).norm(), (a - b).norm()];
    let theta = chord.map(|l| 2.0 * (0.5 * l).min(1.0).asin());
    let h = theta.iter().sum::<f64>() / 2.0;
    let sine = theta.map(f64::sin);
    let orientation = a.dot(&b.cross(&c)).signum();
    let mut cosine = [0.0; 3];
    let mut s = [0.0; 3];
    for i in 0..3 {
        let (next, last) = ((i + 1) % 3, (i + 2) % 3);
        cosine[i] = 2.0 * h.sin() * (h - theta[i]).sin() / (sine[next] * sine[last]) - 1.0;
        s[i] = orientation * (1.0 - cosine[i] * cosine[i]).max(0.0).sqrt();
        if s[i].abs() < FLAT || !s[i].is_finite() {
            return None;
        }
    }
    let mut out = [0.0; 3];
    for i in 0..3 {
        let (next, last) = ((i + 1) % 3, (i + 2) % 3);
        out[i] = (theta[i] - cosine[next] * theta[last] - cosine[last] * theta[next])
            / (corners[i].1 * sine[next] * s[last]);
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CUBE: [[u32; 3]; 12] = [
        [0, 2, 1],
        [1, 2, 3],
        [4, 5, 6],
        [5, 7, 6],
        [0, 1, 4],
        [1, 5, 4],
        [2, 6, 3],
        [3, 6, 7],
        [0, 4, 2],
        [2, 4, 6],
        [1, 3, 5],
        [3, 7, 5],
    ];

    fn cube() -> Vec<Point3<f64>> {
        (0..8).map(|i| Point3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2 & 1))).collect()
    }

    fn apply(weights: &[f64], positions: &[Point3<f64>]) -> Vector3<f64> {
        weights.iter().zip(positions).map(|(w, p)| p.coords * *w).sum()
    }

    #[test]
    fn points_come_back_and_weights_sum_to_one() {
        for p in [Point3::new(0.5, 0.5, 0.5), Point3::new(0.1, 0.8, 0.33), Point3::new(0.99, 0.01, 0.5)] {
            let w = mean_value_weights(&p, &cube(), &CUBE);
            assert!((w.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            assert!((apply(&w, &cube()) - p.coords).norm() < 1e-10, "{p}");
            assert!(w.iter().all(|&x| x > 0.0), "positive in a convex mesh");
        }
    }

    #[test]
    fn a_vertex_takes_itself() {
        let w = mean_value_weights(&cube()[5], &cube(), &CUBE);
        assert_eq!(w[5], 1.0);
        assert_eq!(w.iter().sum::<f64>(), 1.0);
    }
}
