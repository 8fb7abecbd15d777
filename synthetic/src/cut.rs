//! Cutting a mesh along the zero line of a vertex scalar.

use std::collections::HashMap;

use nalgebra::Point3;
use toile_geometry::{Mesh, topology::vertex_components};

/// Vertices that lie this near to the line count as on it, as a share of the scalar's span over the edge.
const SNAP: f32 = 0.12;

/// Keeps what has a scalar of 0 or less; triangles that the line crosses are split on it.
pub fn keep_negative(mesh: &Mesh, scalar: &[f32]) -> Mesh {
    let mut cutter = Cutter { mesh, scalar, positions: mesh.positions.clone(), on_edge: HashMap::new() };
    let mut triangles = Vec::with_capacity(mesh.triangles.len());
    for t in &mesh.triangles {
        let polygon = cutter.clip(t);
        for k in 2..polygon.len() {
            let triangle = [polygon[0], polygon[k - 1], polygon[k]];
            if triangle[0] != triangle[1] && triangle[1] != triangle[2] && triangle[2] != triangle[0] {
                triangles.push(triangle);
            }
        }
    }
    Mesh::new(cutter.positions, triangles).filter_triangles(|_| true).0
}

/// Drops components with fewer vertices than `share` of all.
pub fn drop_crumbs(mesh: &Mesh, share: f32) -> Mesh {
    let (component, count) = vertex_components(mesh.positions.len(), &mesh.triangles);
    let mut sizes = vec![0usize; count];
    component.iter().for_each(|&c| sizes[c as usize] += 1);
    let smallest = (share * mesh.positions.len() as f32) as usize;
    mesh.filter_triangles(|t| sizes[component[mesh.triangles[t][0] as usize] as usize] >= smallest).0
}

struct Cutter<'a> {
    mesh: &'a Mesh,
    scalar: &'a [f32],
    positions: Vec<Point3<f32>>,
    on_edge: HashMap<[u32; 2], u32>,
}

impl Cutter<'_> {
    /// The part of a triangle on the negative side, as a convex polygon.
    fn clip(&mut self, t: &[u32; 3]) -> Vec<u32> {
        let mut polygon = Vec::with_capacity(4);
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            let (sa, sb) = (self.scalar[a as usize], self.scalar[b as usize]);
            if sa <= 0.0 {
                polygon.push(a);
            }
            if (sa <= 0.0) != (sb <= 0.0) {
                polygon.push(self.crossing(a, b));
            }
        }
        polygon.dedup();
        if polygon.len() > 1 && polygon.first() == polygon.last() {
            polygon.pop();
        }
        polygon
    }

    /// The vertex where the line crosses an edge; the kept end itself where it is near.
    fn crossing(&mut self, a: u32, b: u32) -> u32 {
        let (kept, lost) = if self.scalar[a as usize] <= 0.0 { (a, b) } else { (b, a) };
        let (s, l) = (self.scalar[kept as usize], self.scalar[lost as usize]);
        let f = if l - s > 0.0 { -s / (l - s) } else { 0.0 };
        if f < SNAP {
            return kept;
        }
        *self.on_edge.entry([kept, lost]).or_insert_with(|| {
            let (p, q) = (self.mesh.positions[kept as usize], self.mesh.positions[lost as usize]);
            self.positions.push(p + (q - p) * f);
            self.positions.len() as u32 - 1
        })
    }
}

#[cfg(test)]
mod tests {
    use toile_geometry::topology::boundary_loops;

    use super::*;

    #[test]
    fn half_a_grid_keeps_half_the_area_and_one_boundary() {
        let n = 12u32;
        let positions = (0..n * n).map(|i| Point3::new((i % n) as f32, (i / n) as f32, 0.0)).collect();
        let cells = (0..(n - 1) * (n - 1)).map(|i| i / (n - 1) * n + i % (n - 1));
        let mesh = Mesh::new(positions, cells.flat_map(|a| [[a, a + 1, a + n], [a + 1, a + n + 1, a + n]]).collect());
        let line = |p: &Point3<f32>| p.x + 0.3 * p.y - 6.0;
        let scalar: Vec<f32> = mesh.positions.iter().map(line).collect();
        let cut = keep_negative(&mesh, &scalar);
        assert!(cut.positions.iter().all(|p| line(p) < 1e-4));
        let expected: f64 = (0..1100).map(|i| 6.0 - 0.3 * (f64::from(i) + 0.5) / 100.0).sum::<f64>() / 100.0;
        assert!((cut.area() - expected).abs() < 1.2, "{} {expected}", cut.area());
        assert_eq!(boundary_loops(&cut.triangles).len(), 1);
    }
}
