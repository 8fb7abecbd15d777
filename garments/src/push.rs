//! A displacement of cloth that follows pushes at samples and spreads them smoothly.

use nalgebra::{Point3, Vector3};
use toile_geometry::{
    Mesh,
    intersection::{crossings, segment_crosses},
    triangle::ray_hit,
};

use crate::{
    lower_surface::LowerSurface,
    surface_solve::{SurfaceSystem, conjugate_gradients},
};

/// How much more a push weighs than the cloth's stiffness.
const STIFF: f32 = 30.0;
/// Displacements under this are left out, metres: what is not pushed stays to the bit.
const LEAST: f32 = 2e-6;

/// A point of the upper layer that has to move.
#[derive(Debug, Clone, Copy)]
pub struct Push {
    /// The vertices that carry it.
    pub corners: [u32; 3],
    /// Its barycentric coordinates on them.
    pub weights: [f32; 3],
    /// How it has to move, metres.
    pub by: Vector3<f32>,
}

/// Moves the mesh by the smooth displacement that follows `pushes`, which die out over `spread` metres. Each push acts
/// on all vertices that carry its point, by their shares, so that nothing moves further than the largest push. Returns
/// how far each vertex moved.
pub fn displace(mesh: &mut Mesh, system: &SurfaceSystem, pushes: &[Push], spread: f32) -> Vec<f32> {
    let n = mesh.positions.len();
    let anchor = 1.0 / (spread * spread).max(1e-8);
    let mut mass: Vec<f32> = system.areas.iter().map(|a| a * anchor + 1e-6).collect();
    let mut right = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
    for push in pushes {
        for (&v, w) in push.corners.iter().zip(push.weights) {
            mass[v as usize] += STIFF * w;
            (0..3).for_each(|k| right[k][v as usize] += STIFF * w * push.by[k]);
        }
    }
    let diagonal: Vec<f32> = system.diagonal().iter().zip(&mass).map(|(d, m)| d + m).collect();
    let axes = right.map(|right| {
        conjugate_gradients(&right, vec![0.0; n], &diagonal, |x, out| {
            for v in 0..n {
                out[v] = mass[v] * x[v];
            }
            system.add_stiffness(x, out);
        })
    });
    mesh.positions
        .iter_mut()
        .enumerate()
        .map(|(v, p)| {
            let d = Vector3::new(axes[0][v], axes[1][v], axes[2][v]);
            if d.norm() < LEAST {
                return 0.0;
            }
            *p += d;
            d.norm()
        })
        .collect()
}

/// Pushes by `distance` along the lower layer's normal wherever an edge of either layer passes through a triangle of
/// the other.
pub fn crossing_pushes(upper: &Mesh, lowers: &[LowerSurface], distance: f32) -> Vec<Push> {
    let mut pushes = Vec::new();
    for lower in lowers {
        for [t, u] in crossings(upper, lower.mesh, &lower.bvh) {
            let (x, y) = (upper.corners(t as usize), lower.mesh.corners(u as usize));
            let by = lower.smooth_normal(u, [1.0 / 3.0; 3]) * distance;
            let corners = upper.triangles[t as usize];
            for k in 0..3 {
                if let Some(weights) = upper_edge_point(&x, k, &y).or_else(|| lower_edge_point(&x, k, &y)) {
                    pushes.push(Push { corners, weights, by });
                }
            }
        }
    }
    pushes
}

/// Where side k of the upper triangle passes through the lower one.
fn upper_edge_point(x: &[Point3<f32>; 3], k: usize, y: &[Point3<f32>; 3]) -> Option<[f32; 3]> {
    let (p, q) = (x[k], x[(k + 1) % 3]);
    if !segment_crosses(&p, &q, y) {
        return None;
    }
    let t = ray_hit(&p, &(q - p), y).map_or(0.5, |h| h.0.clamp(0.0, 1.0));
    let mut weights = [0.0; 3];
    (weights[k], weights[(k + 1) % 3]) = (1.0 - t, t);
    Some(weights)
}

/// Where side k of the lower triangle passes through the upper one.
fn lower_edge_point(x: &[Point3<f32>; 3], k: usize, y: &[Point3<f32>; 3]) -> Option<[f32; 3]> {
    let (p, q) = (y[k], y[(k + 1) % 3]);
    if !segment_crosses(&p, &q, x) {
        return None;
    }
    Some(ray_hit(&p, &(q - p), x).map_or([1.0 / 3.0; 3], |h| h.1))
}
