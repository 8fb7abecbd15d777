//! How far a measurement of a fitted body may be off.
//!
//! Calibrated on generated people (`examples/uncertainty.rs`): the error of each measurement grows with the share of the skin
//! under its tape that the scan does not show, and with the distance that the body keeps from the scan, which grows with the
//! sensor's noise. Under clothes neither says anything, so that one value stands for all.

use std::collections::BTreeMap;

use nalgebra::Point3;
use serde::{Deserialize, Serialize};
use toile_geometry::{Mesh, bvh::Bvh};

use crate::{
    BodyFit,
    measure::{
        definition::MeasureKind,
        taken::{BodyMeasure, MEASURED},
    },
};

/// Distance between the points of a tape at which the skin is looked up, metres.
const ALONG: f64 = 0.01;
/// A tape of which a smaller share was seen was not.
const SHOWN: f64 = 0.5;
/// The skin that matters around the end of a straight measurement, metres: about the size of a landmark's neighbourhood.
const AROUND: f32 = 0.025;

/// Half the interval that holds 95 of 100 errors of one measurement, millimetres, in parts whose squares add up.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct ErrorModel {
    /// Always there: where landmarks lie, how the body is stood straight.
    pub base_mm: f64,
    /// Added where nothing under the tape was seen; the square grows with the unseen share.
    pub unseen_mm: f64,
    /// For each millimetre of the median distance between scan and body.
    pub per_distance: f64,
    /// In place of all others where the person was dressed.
    pub dressed_mm: f64,
    /// In place of all others where the scan ends above it: how much people differ (`examples/population.rs`).
    #[serde(default)]
    pub population_mm: f64,
}

impl ErrorModel {
    /// Half the interval, metres, where `seen` (0–1) of the skin under the tape was seen and the scan lies `distance_mm` from the body.
    pub fn half_interval_m(&self, seen: f64, distance_mm: f64) -> f64 {
        let unseen = self.unseen_mm.powi(2) * (1.0 - seen);
        1e-3 * (self.base_mm.powi(2) + unseen + (self.per_distance * distance_mm).powi(2)).sqrt()
    }
}

/// The error models by measurement, both sides alike.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct ErrorModels {
    /// What they were calibrated on.
    pub source: String,
    /// By name, without `left` and `right`.
    pub measures: BTreeMap<String, ErrorModel>,
}

impl ErrorModels {
    /// The committed ones; none if they could not be read, which a test excludes.
    pub fn shipped() -> Self {
        serde_json::from_str(include_str!("uncertainty.json")).unwrap_or_default()
    }
}

/// The name of a measurement without its side.
pub fn sideless(name: &str) -> &str {
    name.strip_prefix("left ").or_else(|| name.strip_prefix("right ")).unwrap_or(name)
}

/// Gives each measurement, taken on `standing`, its uncertainty and how much of the skin under it `fit`'s scan shows.
pub(crate) fn weigh(measures: &mut [BodyMeasure], standing: &Mesh, fit: &BodyFit) {
    let models = ErrorModels::shipped();
    let skin = Skin { bvh: Bvh::new(&standing.positions, &standing.triangles), standing, seen: &fit.seen };
    let distance = fit.report.scan_to_body.median_mm;
    for measure in measures {
        let is_cut_off = fit.report.part.as_ref().is_some_and(|part| is_below(measure, &skin, part.below_m));
        let seen = if is_cut_off { 0.0 } else { skin.seen_under(measure) };
        measure.seen = Some(seen);
        let model = models.measures.get(sideless(&measure.name));
        measure.uncertainty_m = model.map(|model| match () {
            () if is_cut_off => 1e-3 * model.population_mm,
            () if fit.report.estimated => 1e-3 * model.dressed_mm,
            () => model.half_interval_m(seen, distance),
        });
        measure.doubt = if is_cut_off {
            Some(cut_off(measure))
        } else {
            measure.uncertainty_m.filter(|&u| u > MEASURED).map(|u| estimated(measure, u, fit.report.estimated))
        };
    }
}

/// Whether a scan that ends `height` metres over the soles does not show what `measure` measures: every height starts at the
/// floor, and other tapes lie on skin below, unless it was seen (an arm that was held up).
fn is_below(measure: &BodyMeasure, skin: &Skin, height: f64) -> bool {
    let lowest = measure.path.iter().fold(f64::INFINITY, |low, p| low.min(p[1]));
    measure.kind == MeasureKind::Height || (lowest < height && skin.seen_under(measure) < SHOWN)
}

fn cut_off(measure: &BodyMeasure) -> String {
    format!("{} was not seen: the scan ends above it, and the value is that of an ordinary body", measure.name)
}

fn estimated(measure: &BodyMeasure, half_interval: f64, is_dressed: bool) -> String {
    let (name, cm) = (&measure.name, 100.0 * half_interval);
    match measure.seen {
        Some(seen) if !is_dressed && seen < 0.7 => {
            let share = 100.0 * (1.0 - seen);
            format!("{name} is estimated to ± {cm:.1} cm: {share:.0} % of the skin under the tape was not seen")
        }
        _ if is_dressed => format!("{name} is estimated to ± {cm:.1} cm: clothes cover the skin"),
        _ => format!("{name} is known to ± {cm:.1} cm only: the scan is too noisy"),
    }
}

/// The standing body's skin and which of it the scan shows.
struct Skin<'a> {
    bvh: Bvh,
    standing: &'a Mesh,
    seen: &'a [bool],
}

impl Skin<'_> {
    /// Share of the skin under a measurement that was seen, 0–1: along its tape, or around the points that it joins.
    fn seen_under(&self, measure: &BodyMeasure) -> f64 {
        let path: Vec<Point3<f64>> = measure.path.iter().map(|p| Point3::from(*p)).collect();
        let shares: Vec<f64> = match measure.kind {
            MeasureKind::Girth | MeasureKind::Length => {
                resampled(&path).iter().filter_map(|p| self.is_seen(p)).map(|seen| f64::from(u8::from(seen))).collect()
            }
            MeasureKind::Height => path.iter().rev().take(1).map(|p| self.seen_around(p)).collect(),
            MeasureKind::Breadth => path.iter().map(|p| self.seen_around(p)).collect(),
        };
        shares.iter().sum::<f64>() / shares.len().max(1) as f64
    }

    /// Whether the skin nearest to a point was seen.
    fn is_seen(&self, point: &Point3<f64>) -> Option<bool> {
        let hit = self.bvh.closest(&point.cast(), 1.0)?;
        let corners = self.standing.triangles[hit.triangle as usize];
        Some(corners.iter().any(|&v| self.seen.get(v as usize).copied().unwrap_or(false)))
    }

    /// Share of the skin around a landmark that was seen, 0–1.
    fn seen_around(&self, point: &Point3<f64>) -> f64 {
        let at: Point3<f32> = point.cast();
        let near = self.standing.positions.iter().zip(self.seen).filter(|(p, _)| (*p - at).norm() < AROUND);
        let (seen, all) = near.fold((0, 0), |(seen, all), (_, &s)| (seen + u32::from(s), all + 1));
        if all == 0 {
            f64::from(u8::from(self.is_seen(point).unwrap_or(false)))
        } else {
            f64::from(seen) / f64::from(all)
        }
    }
}

/// Points at most [`ALONG`] apart on a path.
fn resampled(path: &[Point3<f64>]) -> Vec<Point3<f64>> {
    let mut points: Vec<Point3<f64>> = path.first().copied().into_iter().collect();
    for ends in path.windows(2) {
        let steps = ((ends[1] - ends[0]).norm() / ALONG).ceil().max(1.0) as u32;
        points.extend((1..=steps).map(|k| ends[0] + (ends[1] - ends[0]) * (f64::from(k) / f64::from(steps))));
    }
    points
}
