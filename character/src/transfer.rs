//! Skin weights carried from one surface to another (Hu et al. 2017, §5.2).

use nalgebra::Point3;
use rayon::prelude::*;
use toile_geometry::{Mesh, bvh::Bvh};

use crate::SkinWeights;

/// Weights for `targets` from the closest triangle of `source` by barycentric coordinates.
///
/// `source` and `targets` must be in the same frame and pose. A source without triangles gives every target
/// joint 0.
pub fn closest_triangle_weights(source: &Mesh, weights: &SkinWeights, targets: &[Point3<f32>]) -> SkinWeights {
    let bvh = Bvh::new(&source.positions, &source.triangles);
    let hits: Vec<_> = targets.par_iter().map(|p| bvh.closest(p, f32::INFINITY)).collect();
    let mut out = SkinWeights::default();
    for hit in hits {
        match hit {
            Some(hit) => out.push_interpolated(weights, source.triangles[hit.triangle as usize], hit.barycentric),
            None => out.push(&[]),
        }
    }
    out
}
