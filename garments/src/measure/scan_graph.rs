//! A scan's surface as a graph: areas, colours and the length of hem that each edge stands for.

use nalgebra::{Point3, Vector3};
use toile_geometry::{
    Mesh,
    areas::{triangle_area, vertex_areas},
    holes::FILLED,
    mesh::vertex_normals,
    rims::open_vertices,
    topology::{Edges, VertexNeighbors},
};

use super::color;

/// A scan's surface as labelling needs it.
#[derive(Debug, Clone)]
pub struct ScanGraph {
    /// Positions, metres.
    pub positions: Vec<Point3<f32>>,
    /// Area that each vertex stands for, square metres.
    pub areas: Vec<f32>,
    /// Unit normals.
    pub normals: Vec<Vector3<f32>>,
    /// CIELAB colours; empty for a scan without colours.
    pub lab: Vec<[f32; 3]>,
    /// Vertex pairs of the edges.
    pub edges: Vec<[u32; 2]>,
    /// Length of the dual edge: how much hem an edge stands for when its ends part, metres.
    pub dual_lengths: Vec<f32>,
    /// Neighbours of each vertex.
    pub neighbors: VertexNeighbors,
    /// 1 where nothing was seen and a hole was closed.
    pub filled: Vec<f32>,
    /// True on open edges of the scan.
    pub open: Vec<bool>,
}

impl ScanGraph {
    /// The graph of a scan.
    pub fn new(scan: &Mesh) -> Self {
        let edges = Edges::new(&scan.triangles);
        Self {
            positions: scan.positions.clone(),
            areas: vertex_areas(scan),
            normals: vertex_normals(&scan.positions, &scan.triangles),
            lab: scan.colors.iter().map(|&c| color::lab(c)).collect(),
            open: open_vertices(&edges, scan.positions.len()),
            dual_lengths: dual_lengths(scan, &edges),
            edges: edges.vertices,
            neighbors: VertexNeighbors::new(scan.positions.len(), &scan.triangles),
            filled: scan.attributes.get(FILLED).cloned().unwrap_or_else(|| vec![0.0; scan.positions.len()]),
        }
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.areas.len()
    }

    /// Length of the way from a vertex to its neighbour, metres.
    pub fn step(&self, from: usize, to: usize) -> f32 {
        (self.positions[to] - self.positions[from]).norm()
    }

    /// Connected sets of vertices for which `keep` holds: the set of each vertex (`u32::MAX` outside) and the area of
    /// each set.
    pub fn components(&self, keep: impl Fn(usize) -> bool) -> (Vec<u32>, Vec<f32>) {
        let mut set = vec![u32::MAX; self.len()];
        let mut areas = Vec::new();
        let mut stack = Vec::new();
        for start in 0..self.len() {
            if set[start] != u32::MAX || !keep(start) {
                continue;
            }
            let id = areas.len() as u32;
            areas.push(0.0);
            set[start] = id;
            stack.push(start as u32);
            while let Some(v) = stack.pop() {
                areas[id as usize] += self.areas[v as usize];
                for &n in self.neighbors.of(v as usize) {
                    if set[n as usize] == u32::MAX && keep(n as usize) {
                        set[n as usize] = id;
                        stack.push(n);
                    }
                }
            }
        }
        (set, areas)
    }
}

/// Length of the dual of each edge, metres: a third of each triangle lies along each of its sides.
fn dual_lengths(scan: &Mesh, edges: &Edges) -> Vec<f32> {
    let mut dual_lengths = vec![0.0; edges.vertices.len()];
    for (t, sides) in edges.of_triangle.iter().enumerate() {
        let area = triangle_area(scan.corners(t));
        for &e in sides {
            let [i, j] = edges.vertices[e as usize].map(|v| scan.positions[v as usize]);
            let length = (i - j).norm();
            // The height of a triangle over a side is twice its area over the side's length.
            dual_lengths[e as usize] += (2.0 / 3.0 * area / length.max(1e-6)).min(length);
        }
    }
    dual_lengths
}
