//! Picks fewer vertices that still sample a surface evenly.

use nalgebra::Vector3;
use toile_geometry::{Mesh, areas::vertex_areas};

use super::cloud::key;

/// Picked vertices, ascending, with the area that each stands for (square metres).
#[derive(Debug, Clone, Default)]
pub(crate) struct Thinned {
    pub vertices: Vec<u32>,
    pub areas: Vec<f32>,
}

impl Thinned {
    /// Picks one vertex for each grid cell of `cell` metres and main direction of its normal, among those that
    /// `take` accepts.
    pub fn new(mesh: &Mesh, normals: &[Vector3<f32>], cell: f32, take: impl Fn(usize) -> bool) -> Self {
        let areas = vertex_areas(mesh);
        let mut keyed: Vec<([i32; 4], u32)> = (0..mesh.positions.len())
            .filter(|&v| take(v) && areas[v] > 0.0 && normals[v] != Vector3::zeros())
            .map(|v| (key(&mesh.positions[v], &normals[v], cell), v as u32))
            .collect();
        keyed.sort_unstable();
        let group = |g: &[([i32; 4], u32)]| (g[g.len() / 2].1, g.iter().map(|k| areas[k.1 as usize]).sum::<f32>());
        let mut picked: Vec<(u32, f32)> = keyed.chunk_by(|a, b| a.0 == b.0).map(group).collect();
        picked.sort_unstable_by_key(|p| p.0);
        Self { vertices: picked.iter().map(|p| p.0).collect(), areas: picked.iter().map(|p| p.1).collect() }
    }

    /// The given vertices, all of the same area.
    pub fn of_vertices(vertices: Vec<u32>) -> Self {
        Self { areas: vec![1.0; vertices.len()], vertices }
    }
}
