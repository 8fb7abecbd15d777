//! The noise of a take as its frames show it against the whole: overall, where it is widest, and how far it hangs together.

use std::collections::BTreeMap;

use rayon::prelude::*;
use toile_geometry::statistics::{SIGMA_PER_MAD, median};

use super::residuals::{Residual, residuals};
use crate::{field::Tsdf, frame::unproject, report::FusionReport, take::Fuser};

/// Frames that are compared with the whole.
const FRAMES: usize = 24;
/// Pixels between compared rows, and between compared columns.
const STRIDE: usize = 4;
/// Edge of the regions that the noise is taken of, metres: a leg is twice as wide.
const REGION: f32 = 0.08;
/// A region says something from this many pixels on.
const MIN_PIXELS: usize = 30;
/// The noise of the noisiest regions is that which this share of the regions does not reach.
const QUIET_SHARE: f64 = 0.95;

/// The noise of a take, along the normals of the surface.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Noise {
    /// Robust standard deviation, metres.
    pub sigma: f64,
    /// That of the noisiest twentieth of the regions, metres.
    pub widest: f64,
    /// Correlation of the deviations of pixels four apart, −1..1.
    pub correlation: f64,
}

impl Noise {
    /// Enters it into the report.
    pub(crate) fn enter(&self, report: &mut FusionReport) {
        report.noise_whole_mm = self.sigma * 1e3;
        report.noise_widest_mm = self.widest * 1e3;
        report.noise_correlation = self.correlation;
    }
}

/// Measures the noise of some frames against the whole.
pub(crate) fn measure(fuser: &Fuser, field: &Tsdf) -> Noise {
    let keys = fuser.kept.key_frames(FRAMES);
    let one = |&i: &usize| {
        let kept = &fuser.kept.frames[i];
        let view = kept.view();
        let found = residuals(&view, field, &kept.model_from_camera, STRIDE);
        let place = |r: &Residual| {
            let width = view.camera.width as usize;
            let ray = unproject(&view.camera, (r.pixel % width) as f32, (r.pixel / width) as f32, r.depth);
            let p = toile_geometry::transform_point(&kept.model_from_camera, &ray.into());
            [p.x, p.y, p.z].map(|c| (c / REGION).floor() as i32)
        };
        let places: Vec<[i32; 3]> = found.iter().map(place).collect();
        (Neighbors::of(&found), places, found)
    };
    let frames: Vec<_> = keys.par_iter().map(one).collect();
    let mut regions: BTreeMap<[i32; 3], Vec<f32>> = BTreeMap::new();
    let (mut all, mut neighbors) = (Vec::new(), Neighbors::default());
    for (near, places, found) in &frames {
        neighbors = neighbors.plus(near);
        all.extend(found.iter().map(|r| r.distance.abs()));
        places.iter().zip(found).for_each(|(at, r)| regions.entry(*at).or_default().push(r.distance.abs()));
    }
    let sigma = |values: &mut Vec<f32>| SIGMA_PER_MAD * f64::from(median(values).unwrap_or(0.0));
    let large = regions.into_values().filter(|values| values.len() >= MIN_PIXELS);
    let mut widths: Vec<f64> = large.map(|mut values| sigma(&mut values)).collect();
    widths.sort_unstable_by(f64::total_cmp);
    let widest = widths.get((QUIET_SHARE * widths.len() as f64) as usize).copied();
    let overall = sigma(&mut all);
    Noise { sigma: overall, widest: widest.unwrap_or(overall), correlation: neighbors.correlation() }
}

/// Products of the deviations of neighbours in a row.
#[derive(Debug, Clone, Copy, Default)]
struct Neighbors {
    product: f64,
    square: f64,
}

impl Neighbors {
    fn of(found: &[Residual]) -> Self {
        let next_to = |w: &&[Residual]| w[1].pixel == w[0].pixel + STRIDE;
        found.windows(2).filter(next_to).fold(Self::default(), |sum, w| {
            let [a, b] = [f64::from(w[0].distance), f64::from(w[1].distance)];
            Self { product: sum.product + a * b, square: sum.square + 0.5 * (a * a + b * b) }
        })
    }

    fn plus(self, other: &Self) -> Self {
        Self { product: self.product + other.product, square: self.square + other.square }
    }

    fn correlation(&self) -> f64 {
        self.product / self.square.max(1e-12)
    }
}
