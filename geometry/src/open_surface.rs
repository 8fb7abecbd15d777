//! How high points lie over a surface that may have rims.

use nalgebra::{Point3, Vector3};

use crate::{
    Mesh,
    bvh::{Bvh, Closest},
    rims::open_vertices,
    topology::{Edges, VertexNeighbors},
};

/// A point this far beyond the rim along the surface is not over it any more, metres.
const BEYOND_RIM: f32 = 0.001;
/// Barycentric coordinate under which the closest point counts as on the side.
const ON_SIDE: f32 = 1e-4;

/// A surface with or without rims, ready for queries. Positions may move; triangles stay.
pub struct OpenSurface {
    /// Its positions and triangles.
    pub mesh: Mesh,
    /// Its hierarchy.
    pub bvh: Bvh,
    /// Its unit vertex normals.
    pub normals: Vec<Vector3<f32>>,
    /// Its vertices' neighbours.
    pub neighbors: VertexNeighbors,
    open_vertices: Vec<bool>,
    open_sides: Vec<[bool; 3]>,
}

/// The height of a point over a surface.
#[derive(Debug, Clone, Copy)]
pub struct Height {
    /// Signed distance, metres: negative inside.
    pub value: f32,
    /// The closest point of the surface.
    pub hit: Closest,
    /// The surface's smooth normal there.
    pub normal: Vector3<f32>,
}

/// Where a point lies against a surface.
#[derive(Debug, Clone, Copy)]
pub enum Against {
    /// Beyond reach.
    Far,
    /// Next to the rim, this far beside it, metres.
    Beside(f32),
    /// Over or under the surface.
    Over(Height),
}

impl OpenSurface {
    /// The surface of a mesh, without its colours and attributes.
    pub fn new(mesh: &Mesh) -> Self {
        let mesh = Mesh::new(mesh.positions.clone(), mesh.triangles.clone());
        let edges = Edges::new(&mesh.triangles);
        let open = |e: u32| edges.uses[e as usize] == 1;
        Self {
            bvh: Bvh::new(&mesh.positions, &mesh.triangles),
            normals: mesh.vertex_normals(),
            neighbors: VertexNeighbors::new(mesh.positions.len(), &mesh.triangles),
            open_sides: edges.of_triangle.iter().map(|s| s.map(open)).collect(),
            open_vertices: open_vertices(&edges, mesh.positions.len()),
            mesh,
        }
    }

    /// Call this after the mesh's positions have changed.
    pub fn refresh(&mut self) {
        self.bvh.refit(&self.mesh.positions, &self.mesh.triangles);
        self.normals = self.mesh.vertex_normals();
    }

    /// Where `p` lies, as far as `reach` metres from the surface.
    pub fn locate(&self, p: &Point3<f32>, reach: f32) -> Against {
        let Some(hit) = self.bvh.closest(p, reach) else { return Against::Far };
        let normal = self.smooth_normal(hit.triangle, hit.barycentric);
        let away = p - hit.point;
        let up = away.dot(&normal);
        let beside = (away - normal * up).norm();
        if beside > BEYOND_RIM && self.on_rim(&hit) {
            return Against::Beside(beside - BEYOND_RIM);
        }
        Against::Over(Height { value: if up < 0.0 { -hit.distance } else { hit.distance }, hit, normal })
    }

    /// Height of `p` over the surface; `None` further than `reach` metres from it, and beyond its rim.
    pub fn height(&self, p: &Point3<f32>, reach: f32) -> Option<f32> {
        match self.locate(p, reach) {
            Against::Over(height) => Some(height.value),
            _ => None,
        }
    }

    /// The interpolated vertex normal at barycentric coordinates `w` of a triangle.
    pub fn smooth_normal(&self, triangle: u32, w: [f32; 3]) -> Vector3<f32> {
        let corners = self.mesh.triangles[triangle as usize];
        let sum = corners.iter().zip(w).fold(Vector3::zeros(), |s, (&v, w)| s + self.normals[v as usize] * w);
        sum.try_normalize(1e-12).unwrap_or(self.normals[corners[0] as usize])
    }

    /// True where the closest point lies on an open side, or on a vertex of one.
    fn on_rim(&self, hit: &Closest) -> bool {
        let (sides, w) = (self.open_sides[hit.triangle as usize], hit.barycentric);
        let corners = self.mesh.triangles[hit.triangle as usize];
        (0..3).any(|k| sides[k] && w[(k + 2) % 3] < ON_SIDE)
            || (0..3).any(|k| w[k] > 1.0 - 2.0 * ON_SIDE && self.open_vertices[corners[k] as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_are_signed_and_end_at_the_rim() {
        let corners = [(0.0, 0.0), (0.1, 0.0), (0.1, 0.1), (0.0, 0.1)].map(|(x, y)| Point3::new(x, y, 0.0));
        let square = OpenSurface::new(&Mesh::new(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]]));
        assert_eq!(square.height(&Point3::new(0.05, 0.04, 0.02), 0.1), Some(0.02));
        assert_eq!(square.height(&Point3::new(0.05, 0.04, -0.02), 0.1), Some(-0.02));
        assert_eq!(square.height(&Point3::new(0.05, 0.04, 0.2), 0.1), None);
        let Against::Beside(far) = square.locate(&Point3::new(0.12, 0.04, 0.0), 0.1) else { panic!("not beside") };
        assert!((far - 0.019).abs() < 1e-6, "{far}");
    }
}
