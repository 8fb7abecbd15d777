//! The nearest place of a surface that moves, followed from triangle to triangle.
//!
//! What was over a triangle lies over it or a neighbour one frame later, even where it went through: looked for among all triangles,
//! the nearest would be another limb's.

use nalgebra::{Point3, Vector3};
use toile_geometry::{Mesh, bvh::Bvh, topology::VertexTriangles, triangle};

/// No triangle.
pub(crate) const NONE: u32 = u32::MAX;
/// Limit of the triangles that a place is followed over in one look.
const STEPS: usize = 16;

/// The triangles of a surface and which of them touch.
pub(crate) struct Tracker {
    pub triangles: Vec<[u32; 3]>,
    around: VertexTriangles,
}

/// A place over a surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    pub triangle: u32,
    pub barycentric: [f32; 3],
    /// Height along the surface's normal, metres.
    pub height: f32,
    /// Distance, metres.
    pub distance: f32,
    pub normal: Vector3<f32>,
}

impl Place {
    /// True where the point lies above or below the surface, not beside its rim.
    pub fn is_over(&self) -> bool {
        self.height.abs() >= 0.6 * self.distance
    }
}

impl Tracker {
    pub fn new(mesh: &Mesh) -> Self {
        Self {
            triangles: mesh.triangles.clone(),
            around: VertexTriangles::new(mesh.positions.len(), &mesh.triangles),
        }
    }

    /// The triangle nearest to each of `points`, [`NONE`] where it is farther than `reach`.
    pub fn start(&self, positions: &[Point3<f32>], points: &[Point3<f32>], reach: f32) -> Vec<u32> {
        let bvh = Bvh::new(positions, &self.triangles);
        points.iter().map(|p| bvh.closest(p, reach).map_or(NONE, |hit| hit.triangle)).collect()
    }

    /// Follows the nearest place of the surface to `p`, from `triangle`.
    pub fn follow(
        &self,
        positions: &[Point3<f32>],
        normals: &[Vector3<f32>],
        p: &Point3<f32>,
        triangle: u32,
    ) -> Place {
        let near = |t: u32| {
            let [a, b, c] = self.triangles[t as usize].map(|v| positions[v as usize]);
            let w = triangle::closest_barycentric(p, &a, &b, &c);
            (w, (triangle::at(w, &a, &b, &c) - p).norm_squared())
        };
        let (mut best, (mut weights, mut squared)) = (triangle, near(triangle));
        for _ in 0..STEPS {
            let from = best;
            for &v in &self.triangles[from as usize] {
                for &t in self.around.of(v as usize) {
                    if t != from {
                        let (w, s) = near(t);
                        if s < squared {
                            (best, weights, squared) = (t, w, s);
                        }
                    }
                }
            }
            if best == from {
                break;
            }
        }
        let corners = self.triangles[best as usize].map(|v| v as usize);
        let mixed: Vector3<f32> = corners.iter().zip(weights).map(|(&v, w)| normals[v] * w).sum();
        let normal = mixed.try_normalize(1e-6).unwrap_or_default();
        let at: Vector3<f32> = corners.iter().zip(weights).map(|(&v, w)| positions[v].coords * w).sum();
        let height = (p.coords - at).dot(&normal);
        Place { triangle: best, barycentric: weights, height, distance: squared.sqrt(), normal }
    }
}
