//! A displacement of all layers at once that follows pushes at points of them and spreads them smoothly.

use nalgebra::Vector3;
use toile_geometry::{
    Mesh,
    rims::grow,
    surface_solve::{SurfaceSystem, conjugate_gradients},
    topology::VertexNeighbors,
};

/// How much more a push weighs than the cloth's stiffness.
const STIFF: f32 = 30.0;
/// Smaller displacements are left out, metres: vertices that are not pushed stay to the bit.
const LEAST: f32 = 2e-6;
/// Vertices further than this many spreads from a push do not move.
const FAR: f32 = 4.0;

/// A point that has to move.
#[derive(Debug, Clone, Copy)]
pub(super) struct Push {
    /// The vertices that carry it.
    pub corners: [u32; 3],
    /// Its barycentric coordinates on them.
    pub weights: [f32; 3],
    /// How it has to move, metres.
    pub by: Vector3<f32>,
}

/// All layers' cloth as one elastic surface.
pub(super) struct Cloth {
    system: SurfaceSystem,
    neighbors: VertexNeighbors,
    edge_length: f32,
    held: Vec<bool>,
}

impl Cloth {
    /// The cloth of a mesh, in one or many pieces; vertices that are `held` stay.
    pub fn new(mesh: &Mesh, held: Vec<bool>) -> Self {
        let area = mesh.area() as f32 / mesh.triangles.len().max(1) as f32;
        Self {
            system: SurfaceSystem::new(mesh),
            neighbors: VertexNeighbors::new(mesh.positions.len(), &mesh.triangles),
            // The side of an equilateral triangle of the mean area.
            edge_length: (area * 4.0 / 3.0f32.sqrt()).sqrt().max(1e-4),
            held,
        }
    }

    /// The smooth displacement of each vertex that follows `pushes`, which die out over `spread` metres; vertices far from
    /// all pushes are left out. Each push acts on all vertices that carry its point, by their shares, so that nothing
    /// moves further than the largest push. Minimises Σ stiff·(d − push)² + ∫ |∇d|² + |d|² / spread².
    pub fn displacement(&self, pushes: &[Push], spread: f32) -> Vec<(u32, Vector3<f32>)> {
        let patch = self.around(pushes, spread);
        let mut local = vec![u32::MAX; self.system.len()];
        patch.iter().enumerate().for_each(|(i, &v)| local[v as usize] = i as u32);
        let (system, held) = self.system.part(&patch, &local);
        let anchor = 1.0 / (spread * spread).max(1e-8);
        let mut mass: Vec<f32> = system.areas.iter().zip(held).map(|(a, h)| a * anchor + 1e-6 + h).collect();
        let mut right = [vec![0.0; patch.len()], vec![0.0; patch.len()], vec![0.0; patch.len()]];
        for push in pushes {
            for (&v, w) in push.corners.iter().zip(push.weights) {
                let v = local[v as usize] as usize;
                if v >= patch.len() {
                    continue;
                }
                mass[v] += STIFF * w;
                (0..3).for_each(|k| right[k][v] += STIFF * w * push.by[k]);
            }
        }
        let diagonal: Vec<f32> = system.diagonal().iter().zip(&mass).map(|(d, m)| d + m).collect();
        let [x, y, z] = right.map(|right| {
            conjugate_gradients(&right, vec![0.0; patch.len()], &diagonal, |x, out| {
                out.iter_mut().zip(&mass).zip(x).for_each(|((o, m), x)| *o = m * x);
                system.add_stiffness(x, out);
            })
        });
        let moves = patch.iter().enumerate().map(|(i, &v)| (v, Vector3::new(x[i], y[i], z[i])));
        moves.filter(|(_, d)| d.norm() >= LEAST).collect()
    }

    /// The pushed vertices and some rings around them, ascending.
    fn around(&self, pushes: &[Push], spread: f32) -> Vec<u32> {
        let rings = (FAR * spread / self.edge_length).ceil() as usize;
        let seeds = pushes.iter().flat_map(|p| p.corners).collect();
        let mut around = grow(seeds, &self.neighbors, rings);
        around.retain(|&v| !self.held[v as usize]);
        around
    }
}
