//! How deep points lie inside a scan, on a coarse grid, and its thickest part: chest, belly and seat, however the limbs
//! are held.

use nalgebra::{Matrix3, Point3, Vector3};
use rayon::prelude::*;
use toile_geometry::{Mesh, bvh::Bvh};

/// Step of the grid, metres: a third of a trunk's half depth. Where the scan is larger than a person the step grows.
const STEP: f32 = 0.035;
/// Largest number of grid points.
const MOST: f32 = 200_000.0;
/// Distances outside are looked for within this, metres.
const OUTSIDE: f32 = 0.12;
/// Depth from which on the inside is thick, as a share of the greatest: limbs are half as thick.
const THICK: f32 = 0.6;

/// Signed distances from a scan on a grid: positive inside.
pub(crate) struct Depths {
    low: Point3<f32>,
    step: f32,
    counts: [usize; 3],
    /// Metres; x runs fastest.
    values: Vec<f32>,
}

/// Middle and main direction of the thick part.
pub(crate) struct Thick {
    pub middle: Point3<f64>,
    /// Unit vector along the trunk; which end is up is open.
    pub axis: Vector3<f64>,
}

impl Depths {
    /// `bvh` is over the triangles of `scan`; holes are bridged by winding numbers. `None` for an empty scan.
    pub fn new(scan: &Mesh, bvh: &Bvh) -> Option<Self> {
        let (low, high) = scan.bounds()?;
        let size = high - low;
        let step = STEP.max((size.product() / MOST).cbrt());
        let low = low - Vector3::repeat(step);
        let counts = [0, 1, 2].map(|k| (size[k] / step) as usize + 4);
        let value = |i: usize| {
            let at = [i % counts[0], i / counts[0] % counts[1], i / (counts[0] * counts[1])];
            let p = low + Vector3::from(at.map(|a| a as f32 * step));
            let distance = |reach: f32| bvh.closest(&p, reach).map_or(reach, |hit| hit.distance);
            if bvh.contains(&p) { distance(1.0) } else { -distance(OUTSIDE) }
        };
        let values = (0..counts.iter().product()).into_par_iter().with_min_len(256).map(value).collect();
        Some(Self { low, step, counts, values })
    }

    /// Depth of a point, metres, interpolated; negative outside, and [`OUTSIDE`] beyond the grid.
    pub fn at(&self, p: &Point3<f32>) -> f32 {
        let place = (p - self.low) / self.step;
        let is_within = (0..3).all(|k| place[k] >= 0.0 && place[k] < (self.counts[k] - 1) as f32);
        if !is_within {
            return -OUTSIDE;
        }
        let base = [0, 1, 2].map(|k| place[k] as usize);
        let part = [0, 1, 2].map(|k| place[k] - base[k] as f32);
        let corner = |c: usize| {
            let at = [0, 1, 2].map(|k| base[k] + (c >> k & 1));
            let weight: f32 = (0..3).map(|k| if c >> k & 1 == 1 { part[k] } else { 1.0 - part[k] }).product();
            weight * self.values[at[0] + self.counts[0] * (at[1] + self.counts[1] * at[2])]
        };
        (0..8).map(corner).sum()
    }

    /// `None` where the scan has no inside.
    pub fn thick_part(&self) -> Option<Thick> {
        let deepest = self.values.iter().copied().fold(0.0, f32::max);
        let is_thick = |i: &usize| self.values[*i] > 0.0 && self.values[*i] >= THICK * deepest;
        let point = |i: usize| {
            let at = [i % self.counts[0], i / self.counts[0] % self.counts[1], i / (self.counts[0] * self.counts[1])];
            (self.low + Vector3::from(at.map(|a| a as f32 * self.step))).cast::<f64>()
        };
        let thick: Vec<Point3<f64>> = (0..self.values.len()).filter(is_thick).map(point).collect();
        if thick.is_empty() {
            return None;
        }
        let middle = Point3::from(thick.iter().map(|p| p.coords).sum::<Vector3<f64>>() / thick.len() as f64);
        let spread: Matrix3<f64> = thick.iter().map(|p| (p - middle) * (p - middle).transpose()).sum();
        let eigen = spread.symmetric_eigen();
        let axis = eigen.eigenvectors.column(eigen.eigenvalues.imax()).try_normalize(1e-9)?;
        Some(Thick { middle, axis })
    }
}
