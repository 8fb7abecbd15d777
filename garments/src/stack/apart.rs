//! Layers that move, kept apart in one pose after the other.

use nalgebra::Point3;
use rayon::prelude::*;
use toile_geometry::Mesh;

use super::{Care, layer::Layer, own_crossings, settle};
use crate::settings::StackSettings;

/// Gap over lower layers in motion, metres: half of that at rest. It has to hold for a frame, not for every program and every pose.
const GAP: f32 = 0.0008;
/// Layers are looked for within this distance, metres: they were apart a frame ago.
const REACH: f32 = 0.02;
/// Rounds in each region: what is not parted by then waits for the next frame.
const ROUNDS: usize = 40;

/// Layers that move, kept apart in one pose after the other: [`stack`](super::stack) for a motion.
pub struct Apart {
    layers: Vec<Layer>,
    settings: StackSettings,
}

impl Apart {
    /// For `layers` of these triangles, inside to outside; the first is the body.
    pub fn new(layers: &[&Mesh]) -> Self {
        let new = |(k, mesh): (usize, &&Mesh)| Layer::new(mesh, if k == 0 { 0.0 } else { GAP });
        let settings = StackSettings { reach: REACH, rounds: ROUNDS, ..StackSettings::default() };
        Self { layers: layers.par_iter().enumerate().map(new).collect(), settings }
    }

    /// Moves the vertices of all layers but the first apart where they come too near. Returns how many places are left that are.
    ///
    /// # Panics
    /// Where `positions` are of other layers than those that this was made for.
    pub fn keep(&mut self, positions: &mut [Vec<Point3<f32>>]) -> usize {
        assert_eq!(positions.len(), self.layers.len(), "as many layers as before");
        self.layers.par_iter_mut().zip(&*positions).for_each(|(layer, positions)| {
            assert_eq!(layer.mesh().positions.len(), positions.len(), "as many vertices as before");
            layer.surface.mesh.positions.clone_from(positions);
            layer.surface.refresh();
        });
        let own = own_crossings(&self.layers);
        let (_, left) = settle(&mut self.layers, &own, &self.settings, Care::Frame, &|_| {});
        for (positions, layer) in positions.iter_mut().zip(&self.layers).skip(1) {
            positions.clone_from(&layer.mesh().positions);
        }
        left.len()
    }

    /// Pairs of triangles of different layers that cross now.
    pub fn crossing(&self) -> usize {
        (1..self.layers.len()).map(|upper| super::crossing_pairs(&self.layers, upper).len()).sum()
    }
}
