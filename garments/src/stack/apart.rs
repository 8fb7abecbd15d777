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
const ROUNDS: usize = 24;

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

    /// Looks at the layers where they are now, and moves none.
    ///
    /// # Panics
    /// Where `positions` are of other layers than those that this was made for.
    pub fn look(&mut self, positions: &[Vec<Point3<f32>>]) {
        assert_eq!(positions.len(), self.layers.len(), "as many layers as before");
        self.layers.par_iter_mut().zip(positions).for_each(|(layer, positions)| {
            assert_eq!(layer.mesh().positions.len(), positions.len(), "as many vertices as before");
            layer.surface.mesh.positions.clone_from(positions);
            layer.surface.refresh();
        });
    }

    /// Moves the vertices of all layers but the first apart where they come too near. Returns how many places are left that are.
    ///
    /// # Panics
    /// Where `positions` are of other layers than those that this was made for.
    pub fn keep(&mut self, positions: &mut [Vec<Point3<f32>>]) -> usize {
        self.look(positions);
        let own = own_crossings(&self.layers);
        let (_, left) = settle(&mut self.layers, &own, &self.settings, Care::Frame, &|_| {});
        for (positions, layer) in positions.iter_mut().zip(&self.layers).skip(1) {
            positions.clone_from(&layer.mesh().positions);
        }
        left.len()
    }

    /// Pairs of triangles of different layers that cross now, by an exact test.
    pub fn crossing(&self) -> usize {
        (1..self.layers.len()).map(|upper| super::crossing_pairs(&self.layers, upper).len()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sheet of 40 by 40 vertices, 4 mm apart, at `height(x, z)`, facing up.
    fn sheet(height: impl Fn(f32, f32) -> f32) -> Mesh {
        let n = 40u32;
        let at = |v: u32| {
            let (x, z) = ((v % n) as f32 * 0.004, (v / n) as f32 * 0.004);
            Point3::new(x, height(x, z), z)
        };
        let cell = |q: u32| q / (n - 1) * n + q % (n - 1);
        let cut = |a: u32| [[a, a + n, a + 1], [a + 1, a + n, a + n + 1]];
        Mesh::new((0..n * n).map(at).collect(), (0..(n - 1) * (n - 1)).map(cell).flat_map(cut).collect())
    }

    #[test]
    fn layers_that_move_are_parted_frame_by_frame_and_the_body_stays() {
        let (body, inner, outer) = (sheet(|_, _| 0.0), sheet(|_, _| 0.003), sheet(|_, _| 0.006));
        let mut apart = Apart::new(&[&body, &inner, &outer]);
        for frame in 0..4 {
            // Waves that run through the layers below.
            let wave = |x: f32, z: f32| 0.004 * (60.0 * x + frame as f32).sin() * (50.0 * z).cos();
            let below = sheet(|x, z| 0.003 + wave(x, z)).positions;
            let mut layers = vec![body.positions.clone(), below, outer.positions.clone()];
            assert!(apart.keep(&mut [body.positions.clone(), inner.positions.clone(), outer.positions.clone()]) == 0);
            assert_eq!(apart.keep(&mut layers), 0);
            assert_eq!(apart.crossing(), 0);
            assert_eq!(layers[0], body.positions);
            let moved = layers[2].iter().zip(&outer.positions).map(|(a, b)| (a - b).norm()).fold(0.0, f32::max);
            assert!(moved < 0.01, "{moved}");
        }
    }
}
