//! How tightly cloth is tied to the place where the skeleton carries it.
//!
//! The springs are given by the angular frequency with which a patch of cloth would swing on them, so that they do not
//! depend on the fabric's weight. Cloth on the skin follows within a frame; cloth that hangs free swings as a pendulum of its
//! own length would, about 0.6 m: √(g / 0.6 m) = 4 rad/s.

use nalgebra::{Point3, Vector3};
use toile_geometry::{Mesh, bvh::Bvh, mesh::vertex_normals};

/// Frequency of cloth on the skin, rad/s: an acceleration of 2 g takes it 0.9 mm from its place.
const TIGHT: f64 = 150.0;
/// Frequency of cloth that hangs free, rad/s.
const LOOSE: f64 = 5.0;
/// Distance from the skin up to which cloth lies on it, metres: a looser garment than an undershirt. Chosen by trying: at 8 mm proxies
/// of three subjects left the skin where the scan had lain on it.
pub(crate) const NEAR: f64 = 0.015;
/// Distance from which cloth hangs free, metres: half the width of a trouser leg over a shin, assumed.
pub(crate) const FAR: f64 = 0.06;

/// Distances from the body in the outfit's first pose.
pub(crate) struct Closeness<'a> {
    body: &'a Mesh,
    normals: Vec<Vector3<f32>>,
    bvh: Bvh,
}

/// The place of the body that a vertex of a garment lies over.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Over {
    /// Corners of the body's triangle.
    pub corners: [u32; 3],
    pub barycentric: [f32; 3],
    /// Height over it along the body's normal, metres.
    pub height: f32,
    /// Share by which it lies on the body by its kind: 0 for a part of a skirt or coat that hangs free.
    pub held: f32,
}

impl<'a> Closeness<'a> {
    pub fn new(body: &'a Mesh) -> Self {
        let bvh = Bvh::new(&body.positions, &body.triangles);
        Self { body, normals: vertex_normals(&body.positions, &body.triangles), bvh }
    }

    /// The point of the body that is nearest to `p`, and the body's unit normal there.
    pub fn foot(&self, p: &Point3<f32>) -> Option<(Point3<f32>, Vector3<f32>)> {
        let hit = self.bvh.closest(p, f32::INFINITY)?;
        let corners = self.body.triangles[hit.triangle as usize];
        let normal: Vector3<f32> =
            corners.iter().zip(hit.barycentric).map(|(&v, w)| self.normals[v as usize] * w).sum();
        Some((hit.point, normal.try_normalize(1e-6)?))
    }

    /// The place of the body that is nearest to `p`, of which the share `free` hangs free by its kind.
    pub fn over(&self, p: &Point3<f32>, free: f32) -> Option<Over> {
        let hit = self.bvh.closest(p, f32::INFINITY)?;
        let corners = self.body.triangles[hit.triangle as usize];
        let normal: Vector3<f32> =
            corners.iter().zip(hit.barycentric).map(|(&v, w)| self.normals[v as usize] * w).sum();
        let side = (p - hit.point).dot(&normal).signum();
        Some(Over {
            corners,
            barycentric: hit.barycentric,
            height: side * hit.distance,
            held: (1.0 - free).clamp(0.0, 1.0),
        })
    }
}

/// Frequency of the spring of cloth at a `distance` from the skin, of which the share `free` hangs free by its kind, rad/s.
pub(crate) fn frequency(distance: f64, free: f64) -> f64 {
    let t = ((distance - NEAR) / (FAR - NEAR)).clamp(0.0, 1.0).max(free.clamp(0.0, 1.0));
    // Even steps of the logarithm: each millimetre loosens by the same share.
    TIGHT * (LOOSE / TIGHT).powf(t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cloth_is_tied_the_looser_the_farther_it_lies() {
        assert_eq!(frequency(0.0, 0.0), TIGHT);
        assert!((frequency(0.5, 0.0) - LOOSE).abs() < 1e-9 && (frequency(0.0, 1.0) - LOOSE).abs() < 1e-9);
        let steps: Vec<f64> = (0..10).map(|k| frequency(f64::from(k) * 0.008, 0.0)).collect();
        assert!(steps.windows(2).all(|w| w[1] <= w[0]));
    }
}
