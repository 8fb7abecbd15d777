//! A pair of vertices of a rough mesh that keep their distance.

use nalgebra::Point3;

/// Share of what a link is too long or too short that a step takes away: along edges, across them.
const ALONG: f32 = 0.9;
const ACROSS: f32 = 0.15;

/// A pair of vertices at a distance.
#[derive(Debug, Clone, Copy)]
pub(super) struct Link {
    pub ends: [u32; 2],
    /// 1 for an end that can be moved, 0 for one that is carried.
    pub mobile: [f32; 2],
    /// At rest, metres.
    pub length: f32,
    /// Along an edge, or across one.
    pub along: bool,
}

impl Link {
    #[inline]
    pub fn pull(&self, places: &mut [Point3<f32>]) {
        let [a, b] = self.ends.map(|v| v as usize);
        let way = places[b] - places[a];
        let length = way.norm();
        let sum = self.mobile[0] + self.mobile[1];
        if length < 1e-9 {
            return;
        }
        let share = if self.along { ALONG } else { ACROSS };
        let by = way * (share * (1.0 - self.length / length) / sum);
        places[a] += by * self.mobile[0];
        places[b] -= by * self.mobile[1];
    }
}
