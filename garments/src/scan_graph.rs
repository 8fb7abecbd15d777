//! A scan's surface as a graph: areas, colours and the length of hem that each edge stands for.

use nalgebra::{Point3, Vector3};
use toile_geometry::{
    Mesh,
    mesh::vertex_normals,
    topology::{Edges, VertexNeighbors},
};

use crate::color;

/// What labelling needs to know of a scan's surface.
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
}

impl ScanGraph {
    /// Reads a scan.
    pub fn new(scan: &Mesh) -> Self {
        let edges = Edges::new(&scan.triangles);
        let mut areas = vec![0.0; scan.positions.len()];
        let mut dual_lengths = vec![0.0; edges.vertices.len()];
        for (t, sides) in edges.of_triangle.iter().enumerate() {
            let [a, b, c] = scan.corners(t);
            let area = 0.5 * (b - a).cross(&(c - a)).norm();
            scan.triangles[t].iter().for_each(|&v| areas[v as usize] += area / 3.0);
            for &e in sides {
                let [i, j] = edges.vertices[e as usize];
                let length = (scan.positions[i as usize] - scan.positions[j as usize]).norm();
                // A third of the triangle lies along each side; its height over the side is area / length.
                dual_lengths[e as usize] += (2.0 / 3.0 * area / length.max(1e-6)).min(length);
            }
        }
        Self {
            positions: scan.positions.clone(),
            areas,
            normals: vertex_normals(&scan.positions, &scan.triangles),
            lab: scan.colors.iter().map(|&c| color::lab(c)).collect(),
            edges: edges.vertices,
            dual_lengths,
            neighbors: VertexNeighbors::new(scan.positions.len(), &scan.triangles),
            filled: scan.attributes.get("filled").cloned().unwrap_or_else(|| vec![0.0; scan.positions.len()]),
        }
    }

    /// How many vertices there are.
    pub fn len(&self) -> usize {
        self.areas.len()
    }

    /// True for a scan without vertices.
    pub fn is_empty(&self) -> bool {
        self.areas.is_empty()
    }

    /// Length of the way from a vertex to its neighbour, metres.
    pub fn step(&self, from: usize, to: usize) -> f32 {
        (self.positions[to] - self.positions[from]).norm()
    }

    /// Total area, square metres.
    pub fn area(&self) -> f64 {
        self.areas.iter().map(|&a| f64::from(a)).sum()
    }

    /// True for the vertices on open edges of the scan.
    pub fn open_vertices(&self, scan: &Mesh) -> Vec<bool> {
        let edges = Edges::new(&scan.triangles);
        let mut open = vec![false; self.len()];
        for (e, _) in edges.vertices.iter().zip(&edges.uses).filter(|(_, u)| **u == 1) {
            e.iter().for_each(|&v| open[v as usize] = true);
        }
        open
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
