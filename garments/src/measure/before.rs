//! A scan compared with the surface that was worn before.

use nalgebra::{Point3, Vector3};
use toile_geometry::{
    Mesh,
    bvh::{Bvh, Closest},
    topology::VertexNeighbors,
};

use super::color;
use crate::settings::ExtractSettings;

/// Normals of the earlier surface that count as facing the same way (cosine).
const SAME_WAY: f32 = 0.2;
/// The smallest colour difference is looked for among at most this many vertices of the earlier surface.
const COLORS_LOOKED_AT: usize = 64;

/// The surface worn before, ready for comparison.
pub(super) struct Before<'a> {
    mesh: &'a Mesh,
    bvh: Bvh,
    normals: Vec<Vector3<f32>>,
    vertex_normals: Vec<Vector3<f32>>,
    lab: Vec<[f32; 3]>,
    neighbors: VertexNeighbors,
    filled: Option<&'a Vec<f32>>,
}

/// A scan vertex against the surface worn before.
pub(super) struct Compared {
    /// Signed height over the closest surface that faces the same way, metres; infinite where none is within reach.
    pub height: f32,
    /// Colour difference there; NaN where either side has no colour.
    pub color: f32,
    /// Cosine between the normals.
    pub alignment: f32,
    /// Distance from the closest surface whichever way it faces, metres; infinite where none is within reach.
    pub clearance: f32,
}

impl<'a> Before<'a> {
    pub(super) fn new(mesh: &'a Mesh) -> Self {
        Self {
            mesh,
            bvh: Bvh::new(&mesh.positions, &mesh.triangles),
            normals: mesh.triangle_normals(),
            vertex_normals: mesh.vertex_normals(),
            lab: mesh.colors.iter().map(|&c| color::lab(c)).collect(),
            neighbors: VertexNeighbors::new(mesh.positions.len(), &mesh.triangles),
            filled: mesh.attributes.get(toile_geometry::holes::FILLED),
        }
    }

    /// Compares the scan vertex at `p` with this surface.
    pub(super) fn compare(
        &self,
        p: &Point3<f32>,
        normal: &Vector3<f32>,
        lab: Option<&[f32; 3]>,
        settings: &ExtractSettings,
    ) -> Compared {
        let same_way = |t: u32| self.normals[t as usize].dot(normal) > SAME_WAY;
        let hit = self.bvh.closest_where(p, settings.reach, same_way);
        let Some(hit) = hit.or_else(|| self.bvh.closest(p, settings.reach)) else {
            return Compared { height: f32::INFINITY, color: f32::NAN, alignment: 1.0, clearance: f32::INFINITY };
        };
        let sign = if (p - hit.point).dot(&self.normals[hit.triangle as usize]) >= 0.0 { 1.0 } else { -1.0 };
        let corner = self.mesh.triangles[hit.triangle as usize][largest(hit.barycentric)];
        let color = match lab {
            Some(lab) if !self.lab.is_empty() => self.minimum_difference(corner, lab, settings.color_search),
            _ => f32::NAN,
        };
        let clearance = self.bvh.closest(p, hit.distance).map_or(hit.distance, |any| any.distance);
        Compared { height: sign * hit.distance, color, alignment: self.smooth_normal(&hit).dot(normal), clearance }
    }

    fn smooth_normal(&self, hit: &Closest) -> Vector3<f32> {
        let corners = self.mesh.triangles[hit.triangle as usize];
        let sum = corners.iter().zip(hit.barycentric).map(|(&v, w)| self.vertex_normals[v as usize] * w).sum();
        Vector3::try_normalize(&sum, 1e-12).unwrap_or(self.normals[hit.triangle as usize])
    }

    /// Smallest colour difference from the surface within `radius` metres of vertex `center`.
    fn minimum_difference(&self, center: u32, lab: &[f32; 3], radius: f32) -> f32 {
        let seen = |v: u32| self.filled.is_none_or(|f| f[v as usize] < 0.5);
        let origin = self.mesh.positions[center as usize];
        let mut visited = vec![center];
        let (mut next, mut best) = (0, f32::NAN);
        while next < visited.len() && visited.len() < COLORS_LOOKED_AT {
            let v = visited[next];
            next += 1;
            if seen(v) {
                best = best.min(color::difference(&self.lab[v as usize], lab));
            }
            for &n in self.neighbors.of(v as usize) {
                if (self.mesh.positions[n as usize] - origin).norm() <= radius && !visited.contains(&n) {
                    visited.push(n);
                }
            }
        }
        best
    }
}

fn largest(w: [f32; 3]) -> usize {
    (0..3).max_by(|&a, &b| w[a].total_cmp(&w[b])).unwrap_or(0)
}
