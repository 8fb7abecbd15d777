//! A layer while it is stacked: its surface, and how high points lie over it.

use nalgebra::{Point3, Vector3};
use toile_geometry::{
    Mesh,
    bvh::{Bvh, Closest},
    topology::{Edges, VertexNeighbors},
};

/// A point this far beyond the rim along the surface is not over it any more, metres.
const BEYOND_RIM: f32 = 0.001;
/// Barycentric coordinate under which the closest point counts as on the side.
const ON_SIDE: f32 = 1e-4;

/// A layer, ready for queries.
pub struct WornSurface {
    /// Its positions and triangles.
    pub mesh: Mesh,
    /// Its hierarchy.
    pub bvh: Bvh,
    /// Its unit vertex normals.
    pub normals: Vec<Vector3<f32>>,
    /// Its vertices' neighbours.
    pub neighbors: VertexNeighbors,
    /// How far it has to stay over each layer below, metres.
    pub gap: f32,
    /// True for vertices of open sides.
    pub open_vertices: Vec<bool>,
    open_sides: Vec<[bool; 3]>,
}

/// A point's place over a surface.
#[derive(Debug, Clone, Copy)]
pub struct Height {
    /// Signed distance, metres: negative inside.
    pub value: f32,
    /// The closest point.
    pub hit: Closest,
    /// The surface's smooth normal there.
    pub normal: Vector3<f32>,
}

/// What there is to say about a point near a surface.
#[derive(Debug, Clone, Copy)]
pub enum Place {
    /// Beyond reach.
    Far,
    /// Next to the rim, this far beside it, metres.
    Beside(f32),
    /// Over or under the surface.
    Over(Height),
}

impl WornSurface {
    /// Reads a mesh that has to stay `gap` metres over what lies below.
    pub fn new(mesh: &Mesh, gap: f32) -> Self {
        let mesh = Mesh::new(mesh.positions.clone(), mesh.triangles.clone());
        let edges = Edges::new(&mesh.triangles);
        let open = |e: u32| edges.uses[e as usize] == 1;
        let mut open_vertices = vec![false; mesh.positions.len()];
        for (e, _) in edges.vertices.iter().zip(&edges.uses).filter(|(_, u)| **u == 1) {
            e.iter().for_each(|&v| open_vertices[v as usize] = true);
        }
        Self {
            bvh: Bvh::new(&mesh.positions, &mesh.triangles),
            normals: mesh.vertex_normals(),
            neighbors: VertexNeighbors::new(mesh.positions.len(), &mesh.triangles),
            open_sides: edges.of_triangle.iter().map(|s| s.map(open)).collect(),
            open_vertices,
            gap,
            mesh,
        }
    }

    /// Takes note that the mesh's positions have changed.
    pub fn refresh(&mut self) {
        self.bvh.refit(&self.mesh.positions, &self.mesh.triangles);
        self.normals = self.mesh.vertex_normals();
    }

    /// Where `p` lies, looking up to `reach` metres far.
    pub fn place(&self, p: &Point3<f32>, reach: f32) -> Place {
        let Some(hit) = self.bvh.closest(p, reach) else { return Place::Far };
        let normal = self.smooth_normal(hit.triangle, hit.barycentric);
        let away = p - hit.point;
        let up = away.dot(&normal);
        let beside = (away - normal * up).norm();
        if beside > BEYOND_RIM && self.on_rim(&hit) {
            return Place::Beside(beside - BEYOND_RIM);
        }
        Place::Over(Height { value: if up < 0.0 { -hit.distance } else { hit.distance }, hit, normal })
    }

    /// Height of `p` over the surface, if it is within `reach` and not beyond the rim.
    pub fn height(&self, p: &Point3<f32>, reach: f32) -> Option<f32> {
        match self.place(p, reach) {
            Place::Over(height) => Some(height.value),
            _ => None,
        }
    }

    /// The interpolated vertex normal in a triangle.
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
