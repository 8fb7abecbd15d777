//! Smoothing that does not shrink (Taubin 1995, "A signal processing approach to fair surface design").

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::topology::VertexNeighbors;

/// Step of the smoothing pass.
const LAMBDA: f32 = 0.5;
/// Step of the inflating pass: −λ / (1 − k λ) with pass band k = 0.1.
const MU: f32 = -0.526;

/// Smooths positions by `passes` pairs of a shrinking and an inflating umbrella step.
///
/// `mobility[v]` scales a vertex's steps (0 holds it); empty means 1 everywhere. O(passes · edges).
pub fn taubin(positions: &mut [Point3<f32>], triangles: &[[u32; 3]], passes: usize, mobility: &[f32]) {
    let neighbors = VertexNeighbors::new(positions.len(), triangles);
    for _ in 0..passes {
        umbrella(positions, &neighbors, LAMBDA, mobility);
        umbrella(positions, &neighbors, MU, mobility);
    }
}

fn umbrella(positions: &mut [Point3<f32>], neighbors: &VertexNeighbors, step: f32, mobility: &[f32]) {
    let moves: Vec<Vector3<f32>> = (0..positions.len())
        .into_par_iter()
        .with_min_len(1024)
        .map(|v| {
            let around = neighbors.of(v);
            if around.is_empty() {
                return Vector3::zeros();
            }
            let mean: Vector3<f32> =
                around.iter().map(|&n| positions[n as usize].coords).sum::<Vector3<f32>>() / around.len() as f32;
            (mean - positions[v].coords) * (step * mobility.get(v).copied().unwrap_or(1.0))
        })
        .collect();
    positions.iter_mut().zip(moves).for_each(|(p, m)| *p += m);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A unit sphere of `n` rings with radial noise of ±`noise`.
    fn rough_sphere(n: usize, noise: f32) -> (Vec<Point3<f32>>, Vec<[u32; 3]>) {
        let mut positions = vec![];
        let mut triangles = vec![];
        let mut seed = 1u32;
        for i in 0..=n {
            for j in 0..2 * n {
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let r = 1.0 + noise * ((seed >> 8) as f32 / 8_388_608.0 - 1.0);
                let a = std::f32::consts::PI * (i as f32 + 0.5) / (n as f32 + 1.0);
                let b = std::f32::consts::PI * j as f32 / n as f32;
                positions.push(Point3::new(r * a.sin() * b.cos(), r * a.cos(), r * a.sin() * b.sin()));
            }
        }
        let at = |i: usize, j: usize| (i * 2 * n + j % (2 * n)) as u32;
        for i in 0..n {
            for j in 0..2 * n {
                triangles.push([at(i, j), at(i + 1, j + 1), at(i + 1, j)]);
                triangles.push([at(i, j), at(i, j + 1), at(i + 1, j + 1)]);
            }
        }
        (positions, triangles)
    }

    #[test]
    fn noise_falls_and_the_radius_stays() {
        let (mut positions, triangles) = rough_sphere(40, 0.02);
        let spread = |p: &[Point3<f32>]| {
            let inner = &p[80 * 5..p.len() - 80 * 5];
            let mean = inner.iter().map(|p| p.coords.norm()).sum::<f32>() / inner.len() as f32;
            let var = inner.iter().map(|p| (p.coords.norm() - mean).powi(2)).sum::<f32>() / inner.len() as f32;
            (mean, var.sqrt())
        };
        let before = spread(&positions);
        taubin(&mut positions, &triangles, 10, &[]);
        let after = spread(&positions);
        assert!(after.1 < 0.45 * before.1, "{before:?} {after:?}");
        assert!((after.0 - before.0).abs() < 0.002, "{before:?} {after:?}");
    }

    #[test]
    fn held_vertices_stay() {
        let (mut positions, triangles) = rough_sphere(10, 0.05);
        let before = positions.clone();
        taubin(&mut positions, &triangles, 3, &vec![0.0; before.len()]);
        assert_eq!(positions, before);
    }
}
