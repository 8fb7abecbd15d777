//! How far vertices of a layer moved, and in which box: samples near that box may have come nearer.

use nalgebra::{Point3, Vector3};

use super::region::Region;

/// A box around the vertices that moved.
pub(super) struct Swept {
    low: Point3<f32>,
    high: Point3<f32>,
    /// The largest movement in it, metres.
    most: f32,
}

impl Swept {
    /// The box of the vertices that moved in and around a region, larger by `reach` metres on all sides.
    pub fn new(positions: &[Point3<f32>], moved: &[f32], region: &Region, reach: f32) -> Self {
        let (mut low, mut high) = ([f32::INFINITY; 3].into(), [f32::NEG_INFINITY; 3].into());
        let mut most = 0.0f32;
        // A vertex may have left the region.
        let region = region.grown(moved.iter().copied().fold(0.0, f32::max));
        for (p, &m) in positions.iter().zip(moved).filter(|(p, m)| **m > 0.0 && region.holds(p)) {
            (low, high, most) = (p.inf(&low), p.sup(&high), most.max(m));
        }
        // Around where they are and where they were.
        let around = Vector3::repeat(reach + most);
        Self { low: low - around, high: high + around, most }
    }

    /// By how much the distance of `p` from the layer may have changed, metres.
    pub fn at(&self, p: &Point3<f32>) -> f32 {
        if (0..3).all(|k| (self.low[k]..=self.high[k]).contains(&p[k])) { self.most } else { 0.0 }
    }
}
