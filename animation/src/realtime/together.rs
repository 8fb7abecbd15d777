//! Layers that lie on each other move together.

use super::{class::Class, on::On, rough::Rough};
use crate::blend::anchors::{FAR, NEAR};

/// Distances between two garments, metres: up to the first the upper moves with the lower, from the second on by itself. Twice those
/// between cloth and skin, as either layer can yield.
const WITH: f32 = 2.0 * NEAR as f32;
const APART: f32 = 2.0 * FAR as f32;

/// The outermost of the garments `below` that is near vertex `v` of `garment`.
pub(super) fn lies_on(garment: &Rough, v: usize, below: &[Rough]) -> Option<On> {
    below.iter().enumerate().rev().find_map(|(k, lower)| {
        let hit = lower.bvh.closest(&garment.places[v], APART)?;
        let corners = lower.triangles[hit.triangle as usize];
        let under: f32 = (0..3).map(|k| lower.floats[corners[k] as usize] * hit.barycentric[k]).sum();
        let near = 1.0 - ((hit.distance - WITH) / (APART - WITH)).clamp(0.0, 1.0);
        // A sleeve moves with the sleeve below; cloth that floats over cloth that does not moves by itself.
        let near = if garment.classes[v] == Class::Limb { 1.0 } else { near * near * (3.0 - 2.0 * near) };
        let share = near * (1.0 - garment.floats[v] * (1.0 - under));
        Some(On { garment: k, corners, barycentric: hit.barycentric, share })
    })
}

impl Rough {
    /// Lets the vertices go along with the garments `below` where they lie on them.
    pub fn go_along(&mut self, below: &[Rough]) {
        for (moved, on) in self.moved.iter_mut().zip(&self.on) {
            if let Some(on) = on {
                *moved = on.mixed(moved, &below[on.garment].moved);
            }
        }
    }
}
