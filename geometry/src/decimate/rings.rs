//! The surroundings of an edge.

use super::corners::Corners;

/// Triangles and neighbours around the two ends of an edge; kept between collapses.
#[derive(Default)]
pub(super) struct Rings {
    pub(super) shared: Vec<u32>,
    pub(super) triangles: [Vec<u32>; 2],
    pub(super) neighbors: [Vec<u32>; 2],
}

impl Rings {
    /// Triangles at both ends of an edge (shared), at one of them, and the neighbours of each.
    pub(super) fn gather(&mut self, corners: &Corners, u: u32, v: u32) {
        self.shared.clear();
        for (k, (from, other)) in [(u, v), (v, u)].into_iter().enumerate() {
            let (triangles, neighbors) = (&mut self.triangles[k], &mut self.neighbors[k]);
            triangles.clear();
            neighbors.clear();
            for t in corners.triangles_at(from) {
                let tri = corners.triangles[t as usize];
                if !tri.contains(&other) {
                    triangles.push(t);
                } else if k == 0 {
                    self.shared.push(t);
                }
                neighbors.extend(tri.into_iter().filter(|c| *c != from));
            }
            neighbors.sort_unstable();
            neighbors.dedup();
        }
    }
}
