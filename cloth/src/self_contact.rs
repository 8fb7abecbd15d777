//! A sheet that touches itself: vertices that are far from each other along the cloth keep their distance in space.

use std::collections::HashMap;

use nalgebra::{Point3, Vector3};
use toile_geometry::topology::{Edges, VertexNeighbors};

/// Vertices that are this many edges apart, or fewer, belong to one patch that may bend freely.
const PATCH: usize = 3;

/// Which vertices lie so near along the cloth that bending, not contact, keeps them apart.
#[derive(Debug, Clone)]
pub(crate) struct Neighbourhood {
    /// Mean length of an edge at rest, metres.
    pub spacing: f64,
    patches: Vec<Vec<u32>>,
    rest: Vec<Vector3<f64>>,
    neighbours: VertexNeighbors,
}

/// Two vertices that must keep their distance.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pair {
    pub vertices: [u32; 2],
    /// Distance that they keep, metres.
    pub distance: f64,
    /// N/m.
    pub stiffness: f64,
}

impl Pair {
    /// How much too near the two are, metres.
    pub fn depth(&self, x: &[Vector3<f64>]) -> f64 {
        let [a, b] = self.vertices.map(|v| x[v as usize]);
        self.distance - (a - b).norm()
    }
}

impl Neighbourhood {
    pub fn new(rest: &[Point3<f64>], triangles: &[[u32; 3]]) -> Self {
        let edges = Edges::new(triangles);
        let length = |[a, b]: &[u32; 2]| (rest[*a as usize] - rest[*b as usize]).norm();
        let spacing = edges.vertices.iter().map(length).sum::<f64>() / edges.vertices.len().max(1) as f64;
        let neighbours = VertexNeighbors::new(rest.len(), triangles);
        let patch = |v: u32| {
            let mut seen = vec![v];
            let mut from = 0;
            for _ in 0..PATCH {
                let to = seen.len();
                for k in from..to {
                    for &u in neighbours.of(seen[k] as usize) {
                        if !seen.contains(&u) {
                            seen.push(u);
                        }
                    }
                }
                from = to;
            }
            seen.sort_unstable();
            seen
        };
        let patches = (0..rest.len() as u32).map(patch).collect();
        Self { spacing, patches, rest: rest.iter().map(|p| p.coords).collect(), neighbours }
    }

    /// Draws each velocity towards the mean of its neighbours', at `rate` a second: what the fabric's own friction takes away.
    pub fn damp(&self, velocities: &mut [Vector3<f64>], rate: f64, h: f64) {
        let share = 1.0 - (-rate * h).exp();
        let before = velocities.to_vec();
        for (v, velocity) in velocities.iter_mut().enumerate() {
            let around = self.neighbours.of(v);
            if !around.is_empty() {
                let mean = around.iter().map(|&u| before[u as usize]).sum::<Vector3<f64>>() / around.len() as f64;
                *velocity += (mean - *velocity) * share;
            }
        }
    }

    /// Pairs of vertices at `x` that come nearer than the spacing, or than they were at rest where that is nearer.
    pub fn pairs(&self, x: &[Vector3<f64>], stiffness: &[f64]) -> Vec<Pair> {
        let cell = |p: &Vector3<f64>| p.map(|c| (c / self.spacing).floor() as i32);
        let mut grid: HashMap<[i32; 3], Vec<u32>> = HashMap::with_capacity(x.len());
        for (v, p) in x.iter().enumerate() {
            grid.entry(cell(p).into()).or_default().push(v as u32);
        }
        let mut out = Vec::new();
        for (v, p) in x.iter().enumerate() {
            let c = cell(p);
            for k in 0..27 {
                let at = [c.x + k % 3 - 1, c.y + k / 3 % 3 - 1, c.z + k / 9 - 1];
                for &u in grid.get(&at).map_or(&[][..], Vec::as_slice) {
                    if (u as usize) > v && self.patches[v].binary_search(&u).is_err() {
                        let at_rest = (self.rest[v] - self.rest[u as usize]).norm();
                        let distance = self.spacing.min(at_rest);
                        if (p - x[u as usize]).norm() < self.spacing * 1.5 {
                            let stiffness = 0.5 * stiffness[v].min(stiffness[u as usize]);
                            out.push(Pair { vertices: [v as u32, u], distance, stiffness });
                        }
                    }
                }
            }
        }
        out
    }
}
