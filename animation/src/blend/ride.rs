//! The scanned mesh on its proxy.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_geometry::{Mesh, bvh::Bvh};

/// Where each vertex of a garment's mesh lies on the proxy.
pub(crate) struct Ride {
    places: Vec<([u32; 3], [f32; 3])>,
}

impl Ride {
    /// Binds the vertices of `fine` to the nearest triangles of `proxy`, both in the outfit's first pose.
    pub fn new(fine: &Mesh, proxy: &Mesh) -> Self {
        let bvh = Bvh::new(&proxy.positions, &proxy.triangles);
        let bind = |p: &Point3<f32>| match bvh.closest(p, f32::INFINITY) {
            Some(hit) => (proxy.triangles[hit.triangle as usize], hit.barycentric),
            None => ([0; 3], [0.0; 3]),
        };
        Self { places: fine.positions.par_iter().map(bind).collect() }
    }

    /// Moves `fine` by the displacements of the proxy's vertices from their skinned places, each vertex by its share of `shares`; by all of
    /// it where they are empty.
    pub fn carry(&self, moved: &[Vector3<f32>], shares: &[f32], fine: &mut [Point3<f32>]) {
        fine.par_iter_mut().zip(&self.places).enumerate().for_each(|(k, (p, (corners, weights)))| {
            let share = shares.get(k).copied().unwrap_or(1.0);
            for (&v, w) in corners.iter().zip(weights) {
                *p += moved[v as usize] * (*w * share);
            }
        });
    }
}
