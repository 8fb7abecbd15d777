//! How far layers stretch at most.
//!
//! Columns that press cloth end where the nearest part of the body changes, from trunk to arm: the cloth of an armpit is drawn to both
//! sides there, by more than any cloth gives way. Skin that is blended linearly is drawn out as much at toes and crotch. A triangle
//! that stretches too far takes from those around it, as long as one is too long: its deformation's largest singular value is
//! set to the limit (strain limiting; Wang et al. 2010, section 3), its middle stays.

use nalgebra::{Matrix2, Matrix3x2, Point3, Vector2, Vector3};
use rayon::prelude::*;
use toile_geometry::{Mesh, topology::VertexTriangles};

/// Largest singular value of a triangle's deformation from the scan, for cloth: clothes that are made to give way for comfort do so by a
/// fifth to a quarter (assumed, the same for all fabrics).
pub(crate) const CLOTH: f32 = 1.2;
/// The same for skin, where it is drawn out between toes and at the crotch. Chosen by trying on one subject: at 1.2 it came through itself at
/// the crotch.
pub(crate) const SKIN: f32 = 2.0;
/// Triangles lower than this tell nothing about a stretch, metres: less than the noise of the sensors.
const SLIVER: f32 = 1e-4;
/// Rounds at most where time does not matter.
pub(crate) const ROUNDS: usize = 60;
/// Triangles in a parallel chunk.
const CHUNK: usize = 512;

/// The triangles of a layer and their shapes at rest.
pub(crate) struct StrainLimit {
    limit: f32,
    triangles: Vec<Element>,
    of_vertex: VertexTriangles,
}

/// The triangles of a layer that are too long, used again from frame to frame.
pub(crate) struct Torn {
    /// Rounds at most. What is too long then stays so for the frame.
    rounds: usize,
    /// Ascending.
    long: Vec<u32>,
    next: Vec<u32>,
    /// True for those that are in `next`.
    waits: Vec<bool>,
}

/// A triangle at rest: two edges in its plane, metres, and the inverse of the matrix that has them as columns.
struct Element {
    corners: [u32; 3],
    edges: [Vector2<f32>; 2],
    inverse: Matrix2<f32>,
}

impl StrainLimit {
    /// For a layer that was scanned as `mesh`, whose triangles stretch up to `limit` times.
    pub fn new(mesh: &Mesh, limit: f32) -> Self {
        let of_vertex = VertexTriangles::new(mesh.positions.len(), &mesh.triangles);
        Self { limit, triangles: mesh.triangles.iter().map(|t| Element::new(*t, mesh)).collect(), of_vertex }
    }

    /// Shrinks the triangles that stretch too far where the layer lies at `positions`. Vertices with `normals` only slide across them.
    pub fn apply(&self, positions: &mut [Point3<f32>], normals: Option<&[Vector3<f32>]>, torn: &mut Torn) {
        let Torn { rounds, long, next, waits } = torn;
        let too_far = |t: usize, at: &[Point3<f32>]| self.triangles[t].excess(at, self.limit).is_some();
        let at = &*positions;
        waits.par_iter_mut().enumerate().with_min_len(CHUNK).for_each(|(t, far)| *far = too_far(t, at));
        long.clear();
        long.extend((0..).zip(&*waits).filter(|(_, far)| **far).map(|(t, _): (u32, _)| t));
        waits.fill(false);
        for _ in 0..*rounds {
            if long.is_empty() {
                return;
            }
            next.clear();
            for &t in &*long {
                let triangle = &self.triangles[t as usize];
                triangle.shrink(positions, normals, self.limit);
                let touched = triangle.corners.iter().flat_map(|&v| self.of_vertex.of(v as usize));
                next.extend(touched.filter(|&&n| !std::mem::replace(&mut waits[n as usize], true)));
            }
            next.iter().for_each(|&t| waits[t as usize] = false);
            next.retain(|&t| too_far(t as usize, positions));
            next.sort_unstable();
            std::mem::swap(long, next);
        }
    }
}

impl Torn {
    /// Space for the triangles of a layer, which are shrunk in at most so many `rounds`.
    pub fn new(triangles: usize, rounds: usize) -> Self {
        let space = || Vec::with_capacity(triangles);
        Self { rounds, long: space(), next: space(), waits: vec![false; triangles] }
    }
}

impl Element {
    fn new(corners: [u32; 3], mesh: &Mesh) -> Self {
        let [a, b, c] = corners.map(|v| mesh.positions[v as usize]);
        let (ab, ac) = (b - a, c - a);
        let x = ab.try_normalize(1e-9).unwrap_or_else(Vector3::x);
        let edges = [Vector2::new(ab.norm(), 0.0), Vector2::new(ac.dot(&x), (ac - x * ac.dot(&x)).norm())];
        let matrix = Matrix2::from_columns(&edges);
        let is_sliver = edges[0].x.min(edges[1].y) < SLIVER;
        // Without an inverse a sliver has no deformation, and stays as it is.
        let inverse = if is_sliver { Matrix2::zeros() } else { matrix.try_inverse().unwrap_or_else(Matrix2::zeros) };
        Self { corners, edges, inverse }
    }

    /// What has to go from the deformation along its longest direction at rest, and that direction; none within the limit.
    fn excess(&self, positions: &[Point3<f32>], limit: f32) -> Option<(Vector3<f32>, Vector2<f32>)> {
        let [a, b, c] = self.corners.map(|v| positions[v as usize]);
        let deformation = Matrix3x2::from_columns(&[b - a, c - a]) * self.inverse;
        let [u, v] = [deformation.column(0), deformation.column(1)];
        let (p, q, r) = (u.dot(&u), v.dot(&v), u.dot(&v));
        let (middle, half) = (0.5 * (p + q), 0.5 * (p - q));
        let largest = middle + (half * half + r * r).sqrt();
        if largest <= limit * limit {
            return None;
        }
        // The eigenvector of the larger eigenvalue of [p r; r q], from the row that is not nearly zero.
        let along = if p >= q { Vector2::new(largest - q, r) } else { Vector2::new(r, largest - p) };
        let along = along.try_normalize(1e-12).unwrap_or_else(Vector2::x);
        Some((deformation * along * (1.0 - limit / largest.sqrt()), along))
    }

    fn shrink(&self, positions: &mut [Point3<f32>], normals: Option<&[Vector3<f32>]>, limit: f32) {
        let Some((excess, along)) = self.excess(positions, limit) else { return };
        let [ab, ac] = self.edges.map(|e| -excess * along.dot(&e));
        let middle = (ab + ac) / 3.0;
        for (&v, by) in self.corners.iter().zip([-middle, ab - middle, ac - middle]) {
            let across = |n: &Vector3<f32>| n * n.dot(&by);
            positions[v as usize] += by - normals.map_or_else(Vector3::zeros, |n| across(&n[v as usize]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sheet of 12 by 12 vertices, 5 mm apart.
    fn sheet() -> Mesh {
        let n = 12u32;
        let at = |v: u32| Point3::new((v % n) as f32 * 0.005, 0.0, (v / n) as f32 * 0.005);
        let cell = |q: u32| q / (n - 1) * n + q % (n - 1);
        let cut = |a: u32| [[a, a + n, a + 1], [a + 1, a + n, a + n + 1]];
        Mesh::new((0..n * n).map(at).collect(), (0..(n - 1) * (n - 1)).map(cell).flat_map(cut).collect())
    }

    fn most(limit: &StrainLimit, at: &[Point3<f32>]) -> f32 {
        let of = |t: &Element| {
            let [a, b, c] = t.corners.map(|v| at[v as usize]);
            (Matrix3x2::from_columns(&[b - a, c - a]) * t.inverse).singular_values()[0]
        };
        limit.triangles.iter().map(of).fold(0.0, f32::max)
    }

    #[test]
    fn a_tear_is_shared_by_the_cloth_around_it_and_nothing_else_moves() {
        let mesh = sheet();
        let limit = StrainLimit::new(&mesh, CLOTH);
        let mut torn = mesh.positions.clone();
        // Two vertices of the middle are drawn apart by 10 mm.
        torn[6 * 12 + 5].y -= 0.005;
        torn[6 * 12 + 6].y += 0.005;
        assert!(most(&limit, &torn) > 1.9);
        let mut eased = torn.clone();
        limit.apply(&mut eased, None, &mut Torn::new(mesh.triangles.len(), ROUNDS));
        assert!(most(&limit, &eased) < CLOTH + 1e-3, "{}", most(&limit, &eased));
        let middle = |at: &[Point3<f32>]| at.iter().map(|p| p.coords).sum::<Vector3<f32>>() / at.len() as f32;
        assert!((middle(&eased) - middle(&torn)).norm() < 1e-6);
        let still = mesh.positions.iter().zip(&eased).filter(|(a, b)| a == b).count();
        assert!(still > 60, "{still} of 144 vertices stay");
        let mut unharmed = mesh.positions.clone();
        limit.apply(&mut unharmed, None, &mut Torn::new(mesh.triangles.len(), ROUNDS));
        assert_eq!(unharmed, mesh.positions);
    }

    #[test]
    fn skin_slides_and_keeps_its_heights() {
        let mesh = sheet();
        let limit = StrainLimit::new(&mesh, CLOTH);
        let mut drawn = mesh.positions.clone();
        drawn[6 * 12 + 5].x -= 0.003;
        drawn[6 * 12 + 6].x += 0.003;
        let up = vec![Vector3::y(); drawn.len()];
        limit.apply(&mut drawn, Some(&up), &mut Torn::new(mesh.triangles.len(), ROUNDS));
        assert!(most(&limit, &drawn) < CLOTH + 1e-3, "{}", most(&limit, &drawn));
        assert!(drawn.iter().all(|p| p.y == 0.0));
    }
}
