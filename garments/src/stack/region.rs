//! Regions in which layers have to be moved apart: only the layers' parts in one are looked at while it is solved.

use nalgebra::{Point3, Vector3};
use toile_geometry::Mesh;

/// Vertices this much further stay, but count, metres.
const HEEDED: f32 = 0.02;

/// A box; all in it may move.
#[derive(Debug, Clone, Copy)]
pub(super) struct Region {
    /// Its lowest corner.
    pub low: Point3<f32>,
    /// Its highest corner.
    pub high: Point3<f32>,
}

/// Boxes around all `places`, with a margin in which vertices may move, metres; those that met are one.
pub(super) fn regions(places: impl Iterator<Item = Point3<f32>>, margin: f32) -> Vec<Region> {
    let margin = Vector3::repeat(margin);
    let mut found: Vec<Region> = Vec::new();
    for p in places {
        let mut new = Region { low: p - margin, high: p + margin };
        // Whatever meets the new box joins it, and then the larger box may meet others.
        while let Some(i) = found.iter().position(|r| r.meets(&new)) {
            let old = found.swap_remove(i);
            new = Region { low: old.low.inf(&new.low), high: old.high.sup(&new.high) };
        }
        found.push(new);
    }
    found
}

impl Region {
    /// The whole of space.
    pub fn everywhere() -> Self {
        Self { low: [f32::NEG_INFINITY; 3].into(), high: [f32::INFINITY; 3].into() }
    }

    fn meets(&self, other: &Self) -> bool {
        (0..3).all(|k| self.low[k] <= other.high[k] && other.low[k] <= self.high[k])
    }

    /// True where `p` is in it.
    pub fn holds(&self, p: &Point3<f32>) -> bool {
        (0..3).all(|k| (self.low[k]..=self.high[k]).contains(&p[k]))
    }

    /// The region, larger by `by` metres on all sides.
    pub fn grown(&self, by: f32) -> Self {
        Self { low: self.low - Vector3::repeat(by), high: self.high + Vector3::repeat(by) }
    }

    /// The triangles in and next to the region, and for each of their vertices its index in `mesh`.
    pub fn part(&self, mesh: &Mesh) -> (Mesh, Vec<u32>) {
        let around = self.grown(HEEDED);
        let mut local = vec![u32::MAX; mesh.positions.len()];
        let mut origins = Vec::new();
        let mut part = Mesh::default();
        for corners in &mesh.triangles {
            if corners.iter().all(|&v| !around.holds(&mesh.positions[v as usize])) {
                continue;
            }
            part.triangles.push(corners.map(|v| {
                let place = &mut local[v as usize];
                if *place == u32::MAX {
                    *place = origins.len() as u32;
                    origins.push(v);
                }
                *place
            }));
        }
        part.positions = origins.iter().map(|&v| mesh.positions[v as usize]).collect();
        (part, origins)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_near_one_another_share_a_region_in_any_order() {
        let places = [0.0, 0.5, 0.1, 0.6, 0.2].map(|x| Point3::new(x, 0.0, 0.0));
        for order in [[0, 1, 2, 3, 4], [4, 3, 2, 1, 0], [0, 4, 1, 3, 2]] {
            let mut found = regions(order.into_iter().map(|i| places[i]), 0.06);
            found.sort_by(|a, b| a.low.x.total_cmp(&b.low.x));
            let ends: Vec<[f32; 2]> = found.iter().map(|r| [r.low.x, r.high.x]).collect();
            assert_eq!(ends, [[-0.06, 0.26], [0.44, 0.66]]);
        }
    }
}
