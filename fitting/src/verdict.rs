//! Residuals, coverage and whether a fit is to be trusted.

use std::collections::BTreeMap;

use nalgebra::Point3;
use rayon::prelude::*;
use serde::Serialize;
use toile_character::{BodyModel, Region};
use toile_geometry::{Mesh, bvh::Bvh, mesh::vertex_normals};

use crate::{
    body_fit::trust_of,
    cloud::{Cloud, Samples, vertex_areas},
    level::LevelResult,
    measure::Measurements,
};

/// Whether a fit is to be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// The body explains the scan.
    Trusted,
    /// Usable, but look at it: see the report's reasons.
    Doubtful,
    /// The scan is probably no single standing person, or too little of one.
    Failed,
}

/// Distances between two surfaces, millimetres, weighted by area.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct DistanceStats {
    /// Mean.
    pub mean_mm: f64,
    /// Median.
    pub median_mm: f64,
    /// 95th percentile.
    pub p95_mm: f64,
}

/// What a body fit decided and how good it is.
#[derive(Debug, Clone, Serialize)]
pub struct FitReport {
    /// Whether to trust it.
    pub verdict: Verdict,
    /// Why not, in words; empty where it is trusted.
    pub reasons: Vec<String>,
    /// What was mended on the scan, in words.
    pub notices: Vec<String>,
    /// Gauss–Newton steps over all starts and levels.
    pub iterations: usize,
    /// Whether the finest level came to rest.
    pub converged: bool,
    /// Trusted scan surface to the statistical model.
    pub scan_to_model: DistanceStats,
    /// Trusted scan surface to the conformed body.
    pub scan_to_body: DistanceStats,
    /// Part of the body's outer surface that the scan covers, 0–1.
    pub body_covered: f64,
    /// Part of the scan's trusted surface that lies within 20 mm of the body, 0–1.
    pub scan_explained: f64,
    /// Root mean square of β: 1 for an ordinary body.
    pub shape_rms: f64,
    /// Shape and measures are estimated: the person was dressed.
    pub estimated: bool,
    /// Part of each region's outer surface that the scan covers, 0–1, as `body_covered`.
    pub region_covered: BTreeMap<&'static str, f64>,
}

/// A region of which less than this is covered is estimated.
const HARDLY_SEEN: f64 = 0.3;
/// A conformed body farther than this from its own scan has not found its place, millimetres.
const LOOSE_MM: f64 = 3.0;
/// Distance within which the body explains the scan, metres: skin, and under clothes.
const EXPLAINED: f32 = 0.02;
const EXPLAINED_DRESSED: f32 = 0.10;
/// Least part of the scan that a fit in its place explains, per cent: an arm laid wrongly leaves 0.7 % over, noise 0.4 % at most.
const EXPLAINS: f64 = 99.5;
const EXPLAINS_DRESSED: f64 = 97.0;
/// Root mean square of β from which a shape is too unusual to be believed: people outside the model's span reach 1.9.
const UNUSUAL: f64 = 2.0;
/// Distance within which the scan covers the body, metres: skin, and under clothes.
const COVERED: f32 = 0.015;
const COVERED_DRESSED: f32 = 0.10;

/// Measures a fit and judges it.
pub(crate) fn judge(
    model: &BodyModel,
    scan: &Mesh,
    fine: &LevelResult,
    body: &[Point3<f32>],
    measurements: &Measurements,
    notices: Vec<String>,
    dressed: bool,
) -> FitReport {
    let trust = &trust_of(scan);
    let samples = Samples::of_mesh(scan, &scan.normals, trust, 0.012);
    let posed = model.posed(&fine.state.beta, &fine.state.pose);
    let to_model = distances(&samples, &posed, model);
    let to_body = distances(&samples, body, model);
    let within = if dressed { EXPLAINED_DRESSED } else { EXPLAINED };
    let total: f64 = samples.weights.iter().map(|&w| f64::from(w)).sum::<f64>().max(1e-12);
    let near = to_model.iter().zip(&samples.weights).filter(|(d, _)| **d <= within);
    let explained = near.map(|(_, &w)| f64::from(w)).sum::<f64>() / total;
    let beta = &fine.state.beta;
    let covered = covered(model, body, scan, trust, if dressed { COVERED_DRESSED } else { COVERED });
    let mut report = FitReport {
        verdict: Verdict::Trusted,
        reasons: Vec::new(),
        notices,
        iterations: fine.iterations,
        converged: fine.converged,
        scan_to_model: stats(&to_model, &samples.weights),
        scan_to_body: stats(&to_body, &samples.weights),
        body_covered: covered.whole,
        scan_explained: explained,
        shape_rms: (beta.iter().map(|b| b * b).sum::<f64>() / beta.len().max(1) as f64).sqrt(),
        estimated: dressed,
        region_covered: covered.regions,
    };
    report.decide(measurements);
    report
}

impl FitReport {
    fn decide(&mut self, measurements: &Measurements) {
        let mut worst = Verdict::Trusted;
        let mut find = |bad: bool, failed: bool, reason: String| {
            if bad || failed {
                self.reasons.push(reason);
                let here = if failed { Verdict::Failed } else { Verdict::Doubtful };
                worst = if worst == Verdict::Failed { worst } else { here };
            }
        };
        let (explained, covered) = (100.0 * self.scan_explained, 100.0 * self.body_covered);
        let enough = if self.estimated { EXPLAINS_DRESSED } else { EXPLAINS };
        find(
            explained < enough,
            explained < 80.0,
            format!(
                "the body explains {explained:.1} % of the scan: is there one standing person in it, alone and lightly dressed?"
            ),
        );
        find(
            covered < 60.0,
            covered < 25.0,
            format!("the scan covers {covered:.0} % of the body, the rest is estimated; scan all around"),
        );
        let hidden: Vec<&str> = self.region_covered.iter().filter(|r| *r.1 < HARDLY_SEEN).map(|r| *r.0).collect();
        let (small, large): (Vec<&str>, Vec<&str>) =
            hidden.into_iter().partition(|r| r.ends_with("hand") || r.ends_with("foot") || *r == "head");
        if !small.is_empty() {
            // a hand, a foot or the head alone hardly moves the rest of the body
            self.notices.push(format!("hardly seen and therefore estimated: {}", small.join(", ")));
        }
        find(
            !large.is_empty() && covered >= 60.0,
            false,
            format!("hardly seen and therefore estimated: {}", large.join(", ")),
        );
        let (mean, limit) = (self.scan_to_model.mean_mm, if self.estimated { 40.0 } else { 8.0 });
        find(
            mean > limit,
            mean > 2.5 * limit,
            format!(
                "the model lies {mean:.1} mm from the scan on average: are clothes, hair or things held in the way?"
            ),
        );
        let mean = self.scan_to_body.mean_mm;
        let loose = mean > LOOSE_MM && !self.estimated;
        find(
            loose,
            false,
            format!(
                "the body's own surface lies {mean:.1} mm from the scan on average: look whether it stands in the scan"
            ),
        );
        let dressed = "the person is dressed: shape and measures are estimated".to_owned();
        find(self.estimated, false, dressed);
        let stature = measurements.stature_m;
        let human = (1.2..=2.2).contains(&stature);
        find(
            !human,
            !(0.6..=2.5).contains(&stature),
            format!("the body would stand {stature:.2} m tall: is it a whole person, and is the scan in metres?"),
        );
        let rms = self.shape_rms;
        find(
            rms > UNUSUAL,
            rms > 3.0,
            format!(
                "the shape is {rms:.1} times as unusual as an ordinary body's: is there one person in it, and nothing else?"
            ),
        );
        // each doubt alone may have a reason; many together have one: the fit is wrong
        let many = if self.estimated { 4 } else { 3 };
        self.verdict = if self.reasons.len() >= many { Verdict::Failed } else { worst };
    }
}

fn distances(samples: &Samples, points: &[Point3<f32>], model: &BodyModel) -> Vec<f32> {
    let normals = vertex_normals(points, &model.triangles);
    let bvh = Bvh::new(points, &model.triangles);
    (0..samples.points.len())
        .into_par_iter()
        .with_min_len(128)
        .map(|k| {
            let fits = |t: u32| normals[model.triangles[t as usize][0] as usize].dot(&samples.normals[k]) > 0.0;
            bvh.closest_where(&samples.points[k], 0.1, fits).map_or(0.1, |h| h.distance)
        })
        .collect()
}

fn stats(distances: &[f32], weights: &[f32]) -> DistanceStats {
    let mut sorted: Vec<(f32, f32)> = distances.iter().copied().zip(weights.iter().copied()).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = weights.iter().map(|&w| f64::from(w)).sum::<f64>().max(1e-12);
    let quantile = |q: f64| {
        let mut sum = 0.0;
        let hit = sorted.iter().find(|(_, w)| {
            sum += f64::from(*w);
            sum >= q * total
        });
        hit.map_or(0.0, |h| 1e3 * f64::from(h.0))
    };
    let mean = sorted.iter().map(|(d, w)| f64::from(*d) * f64::from(*w)).sum::<f64>() / total;
    DistanceStats { mean_mm: 1e3 * mean, median_mm: quantile(0.5), p95_mm: quantile(0.95) }
}

/// Covered part of the body and of its regions, 0–1.
struct Covered {
    whole: f64,
    regions: BTreeMap<&'static str, f64>,
}

/// Part of the body's outer area with trusted scan within `reach` metres.
fn covered(model: &BodyModel, body: &[Point3<f32>], scan: &Mesh, trust: &[f32], reach: f32) -> Covered {
    let none = Covered { whole: 0.0, regions: BTreeMap::new() };
    let Some(cloud) = Cloud::new(Samples::of_mesh(scan, &scan.normals, trust, 0.01)) else { return none };
    let mesh = Mesh::new(body.to_vec(), model.triangles.clone());
    let (areas, normals) = (vertex_areas(&mesh), mesh.vertex_normals());
    let seen: Vec<bool> = (0..body.len())
        .into_par_iter()
        .with_min_len(128)
        .map(|v| {
            let hit = cloud.nearest(&body[v], &normals[v], reach, 0.3).map(|q| q as usize);
            hit.is_some_and(|q| cloud.samples.weights[q] > 0.5 * cloud.samples.areas[q])
        })
        .collect();
    let part = |is_in: &dyn Fn(usize) -> bool| {
        let (mut all, mut some) = (0.0, 0.0);
        for v in (0..body.len()).filter(|&v| !model.inner[v] && is_in(v)) {
            all += f64::from(areas[v]);
            some += if seen[v] { f64::from(areas[v]) } else { 0.0 };
        }
        some / f64::max(all, 1e-12)
    };
    let region = |r: &Region| (r.words(), part(&|v| model.regions[v] == *r));
    Covered { whole: part(&|_| true), regions: Region::ALL.iter().map(region).collect() }
}
