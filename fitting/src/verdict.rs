//! Residuals, coverage and whether a fit is to be trusted.

use nalgebra::Point3;
use rayon::prelude::*;
use serde::Serialize;
use toile_character::BodyModel;
use toile_geometry::{Mesh, bvh::Bvh, mesh::vertex_normals};

use crate::{
    cloud::{Cloud, Samples, vertex_areas},
    level::LevelResult,
    measure::Measurements,
};

/// Whether a fit is to be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
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
}

/// Distance within which the body explains the scan, metres.
const EXPLAINED: f32 = 0.02;

/// Measures a fit and judges it.
pub(crate) fn judge(
    model: &BodyModel,
    scan: &Mesh,
    trust: &[f32],
    fine: &LevelResult,
    body: &[Point3<f32>],
    measurements: &Measurements,
    notices: Vec<String>,
) -> FitReport {
    let samples = Samples::of_mesh(scan, &scan.normals, trust, 0.012);
    let posed = model.posed(&fine.state.beta, &fine.state.pose);
    let to_model = distances(&samples, &posed, model);
    let to_body = distances(&samples, body, model);
    let total: f64 = samples.weights.iter().map(|&w| f64::from(w)).sum::<f64>().max(1e-12);
    let near = to_model.iter().zip(&samples.weights).filter(|(d, _)| **d <= EXPLAINED);
    let explained = near.map(|(_, &w)| f64::from(w)).sum::<f64>() / total;
    let beta = &fine.state.beta;
    let mut report = FitReport {
        verdict: Verdict::Trusted,
        reasons: Vec::new(),
        notices,
        iterations: fine.iterations,
        converged: fine.converged,
        scan_to_model: stats(&to_model, &samples.weights),
        scan_to_body: stats(&to_body, &samples.weights),
        body_covered: covered(model, body, scan, trust),
        scan_explained: explained,
        shape_rms: (beta.iter().map(|b| b * b).sum::<f64>() / beta.len().max(1) as f64).sqrt(),
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
        find(
            explained < 95.0,
            explained < 80.0,
            format!(
                "the body explains {explained:.0} % of the scan: is there one standing person in it, alone and lightly dressed?"
            ),
        );
        find(covered < 60.0, covered < 25.0, format!("the scan covers {covered:.0} % of the body; scan all around"));
        let (mean, limit) = (self.scan_to_model.mean_mm, 8.0);
        find(mean > limit, mean > 20.0, format!("the model lies {mean:.1} mm from the scan on average"));
        let stature = measurements.stature_m;
        let human = (1.2..=2.2).contains(&stature);
        find(!human, !(0.6..=2.5).contains(&stature), format!("the body would stand {stature:.2} m tall"));
        let rms = self.shape_rms;
        find(rms > 1.8, rms > 3.0, format!("the shape is {rms:.1} times as unusual as an ordinary body's"));
        // each doubt alone may have a reason; many together have one: the fit is wrong
        self.verdict = if self.reasons.len() >= 3 { Verdict::Failed } else { worst };
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

/// Part of the body's outer area with trusted scan within 15 mm.
fn covered(model: &BodyModel, body: &[Point3<f32>], scan: &Mesh, trust: &[f32]) -> f64 {
    let Some(cloud) = Cloud::new(Samples::of_mesh(scan, &scan.normals, trust, 0.01)) else { return 0.0 };
    let mesh = Mesh::new(body.to_vec(), model.triangles.clone());
    let (areas, normals) = (vertex_areas(&mesh), mesh.vertex_normals());
    let seen: Vec<bool> = (0..body.len())
        .into_par_iter()
        .with_min_len(128)
        .map(|v| {
            let hit = cloud.nearest(&body[v], &normals[v], 0.015, 0.3).map(|q| q as usize);
            hit.is_some_and(|q| cloud.samples.weights[q] > 0.5 * cloud.samples.areas[q])
        })
        .collect();
    let sum = |keep: &dyn Fn(usize) -> bool| -> f64 {
        (0..body.len()).filter(|&v| !model.inner[v] && keep(v)).map(|v| f64::from(areas[v])).sum()
    };
    sum(&|v| seen[v]) / sum(&|_| true).max(1e-12)
}
