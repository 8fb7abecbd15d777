//! The scan's triangles as a vertex of the body meets them: nearest compatible point, trust, and the rims of holes.

use nalgebra::{Point3, Vector3};
use toile_geometry::{Mesh, bvh::Bvh};

/// A contact beside the surface by more than this share of its distance lies on the rim of a hole: the foot of a
/// perpendicular on a surface whose normal is off by 17° slips that far.
const SLIP_PER_DISTANCE: f32 = 0.3;
/// Slip that noise and the size of triangles explain wherever the scan is, metres.
const SLIP_BY_NOISE: f32 = 0.002;

/// How far each scan vertex is trusted, 0 to 1: what fusion filled in was not seen.
pub(crate) fn trust_of(scan: &Mesh) -> Vec<f32> {
    match scan.attributes.get("filled") {
        Some(filled) => filled.iter().map(|f| 1.0 - 0.98 * f.clamp(0.0, 1.0)).collect(),
        None => vec![1.0; scan.positions.len()],
    }
}

/// A scan with the trust of its vertices and the hierarchy over its triangles.
#[derive(Clone, Copy)]
pub(crate) struct ScanSurface<'a> {
    mesh: &'a Mesh,
    trust: &'a [f32],
    bvh: &'a Bvh,
}

/// The scan point that is nearest to a vertex.
pub(crate) struct Contact {
    /// Metres, in the scan's frame.
    pub point: Point3<f32>,
    /// Unit normal of the triangle it lies on; zero where the triangle has no area.
    pub normal: Vector3<f32>,
    /// Interpolated trust, 0–1.
    pub trust: f32,
    /// Distance from the vertex, metres.
    pub distance: f32,
    /// From the contact to the vertex, metres.
    pub offset: Vector3<f32>,
}

impl<'a> ScanSurface<'a> {
    /// `trust` has one entry a vertex; `bvh` is built over the same triangles.
    pub fn new(mesh: &'a Mesh, trust: &'a [f32], bvh: &'a Bvh) -> Self {
        Self { mesh, trust, bvh }
    }

    /// The nearest point within `reach` metres on a triangle whose normal makes a cosine above `min_cos` with `n`.
    pub fn nearest(&self, p: &Point3<f32>, n: &Vector3<f32>, reach: f32, min_cos: f32) -> Option<Contact> {
        let hit = self.bvh.closest_where(p, reach, |t| self.normal(t).dot(n) > min_cos)?;
        let corners = self.mesh.triangles[hit.triangle as usize];
        let trust = (0..3).map(|k| self.trust[corners[k] as usize] * hit.barycentric[k]).sum();
        let normal = self.normal(hit.triangle);
        Some(Contact { point: hit.point, normal, trust, distance: hit.distance, offset: p - hit.point })
    }

    fn normal(&self, t: u32) -> Vector3<f32> {
        let [a, b, c] = self.mesh.corners(t as usize);
        (b - a).cross(&(c - a)).try_normalize(1e-20).unwrap_or_default()
    }
}

impl Contact {
    /// Whether the contact lies far along the surface with unit normal `n`: it is then the rim of a hole, and says
    /// nothing of what lies over the hole.
    pub fn is_rim(&self, n: &Vector3<f32>) -> bool {
        let slip = (self.offset - n * self.offset.dot(n)).norm();
        slip > SLIP_PER_DISTANCE * self.distance + SLIP_BY_NOISE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beside_a_hole_the_contact_is_a_rim_and_over_the_surface_it_is_not() {
        let corners = [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]];
        let mesh = Mesh::new(corners.map(Point3::from).to_vec(), vec![[0, 1, 2]]);
        let bvh = Bvh::new(&mesh.positions, &mesh.triangles);
        let surface = ScanSurface::new(&mesh, &[1.0, 0.5, 0.5], &bvh);
        let up = Vector3::y();
        let over = surface.nearest(&Point3::new(0.2, 0.01, 0.2), &up, 0.1, 0.5).unwrap();
        assert!(!over.is_rim(&up) && (over.trust - 0.8).abs() < 1e-6 && over.normal == up);
        let beside = surface.nearest(&Point3::new(-0.02, 0.01, 0.2), &up, 0.1, 0.5).unwrap();
        assert!(beside.is_rim(&up));
        assert!(surface.nearest(&Point3::new(0.2, 0.01, 0.2), &-up, 0.1, 0.5).is_none());
    }
}
