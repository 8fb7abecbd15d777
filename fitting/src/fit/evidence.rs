//! Distances and coverage: what a verdict is based on.

use std::collections::BTreeMap;

use nalgebra::Point3;
use rayon::prelude::*;
use toile_character::{BodyModel, Region};
use toile_geometry::{Mesh, areas::vertex_areas, bvh::Bvh, mesh::vertex_normals};

use super::report::DistanceStats;
use crate::surface::{Cloud, Samples};

/// Cell of the scan's samples that distances are taken from, metres.
const DISTANCE_CELL: f32 = 0.012;
/// Cell of the scan's samples that coverage is taken from, metres.
const COVER_CELL: f32 = 0.01;
/// Distances are looked for within this and counted as this beyond it, metres: far more than any cloth stands off.
const FARTHEST: f32 = 0.5;
/// Smallest cosine between the normals of scan and body: points of the same side only.
const SAME_SIDE: f32 = 0.0;
/// The same where the scan is to cover a vertex.
const COVER_COS: f32 = 0.3;

/// Distances from the trusted scan to a body's surface.
pub(crate) struct Distances {
    /// Metres, one for each sample.
    metres: Vec<f32>,
    /// Trusted area of each sample, square metres.
    weights: Vec<f32>,
}

/// Share of the body's outer surface, and of each region's, that the scan covers, 0–1.
pub(crate) struct Coverage {
    pub whole: f64,
    pub regions: BTreeMap<String, f64>,
    /// Of each vertex, whether the scan covers it.
    pub seen: Vec<bool>,
}

/// Samples of the trusted scan that distances are taken from.
pub(crate) fn samples(scan: &Mesh, trust: &[f32]) -> Samples {
    Samples::of_mesh(scan, &scan.normals, trust, DISTANCE_CELL)
}

impl Distances {
    /// From `samples` to the template's triangles at `points`.
    pub fn new(samples: &Samples, points: &[Point3<f32>], model: &BodyModel) -> Self {
        let normals = vertex_normals(points, &model.triangles);
        let bvh = Bvh::new(points, &model.triangles);
        let distance = |k: usize| {
            let normal_of = |t: u32| normals[model.triangles[t as usize][0] as usize];
            let fits = |t: u32| normal_of(t).dot(&samples.normals[k]) > SAME_SIDE;
            bvh.closest_where(&samples.points[k], FARTHEST, fits).map_or(FARTHEST, |h| h.distance)
        };
        let metres = (0..samples.points.len()).into_par_iter().with_min_len(128).map(distance).collect();
        Self { metres, weights: samples.weights.clone() }
    }

    /// Share of the scan within `reach` metres of the body, 0–1.
    pub fn share_within(&self, reach: f32) -> f64 {
        let near = self.metres.iter().zip(&self.weights).filter(|(d, _)| **d <= reach);
        near.map(|(_, &w)| f64::from(w)).sum::<f64>() / self.total()
    }

    /// Mean, median and 95th percentile.
    pub fn stats(&self) -> DistanceStats {
        let mut sorted: Vec<(f32, f32)> = self.metres.iter().copied().zip(self.weights.iter().copied()).collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        let total = self.total();
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

    fn total(&self) -> f64 {
        self.weights.iter().map(|&w| f64::from(w)).sum::<f64>().max(1e-12)
    }
}

impl Coverage {
    /// Outer area of the body at `points` with trusted scan within `reach` metres.
    pub fn new(model: &BodyModel, points: &[Point3<f32>], scan: &Mesh, trust: &[f32], reach: f32) -> Self {
        let areas = vertex_areas(&Mesh::new(points.to_vec(), model.triangles.clone()));
        let seen = seen_vertices(model, points, (scan, trust), reach);
        let share = |is_in: &dyn Fn(usize) -> bool| {
            let (mut all, mut some) = (0.0, 0.0);
            for v in (0..points.len()).filter(|&v| !model.inner[v] && is_in(v)) {
                all += f64::from(areas[v]);
                some += if seen[v] { f64::from(areas[v]) } else { 0.0 };
            }
            some / f64::max(all, 1e-12)
        };
        let region = |r: &Region| (r.words().to_owned(), share(&|v| model.regions[v] == *r));
        let (whole, regions) = (share(&|_| true), Region::ALL.iter().map(region).collect());
        Self { whole, regions, seen }
    }

    /// The share of one region, 0–1.
    pub fn of(&self, region: Region) -> f64 {
        self.regions.get(region.words()).copied().unwrap_or(0.0)
    }
}

/// Of each vertex of a body at `points`, whether trusted scan lies within `reach` metres on the same side.
fn seen_vertices(model: &BodyModel, points: &[Point3<f32>], (scan, trust): (&Mesh, &[f32]), reach: f32) -> Vec<bool> {
    let Some(cloud) = Cloud::new(Samples::of_mesh(scan, &scan.normals, trust, COVER_CELL)) else {
        return vec![false; points.len()];
    };
    let normals = vertex_normals(points, &model.triangles);
    let is_seen = |v: usize| {
        let hit = cloud.nearest(&points[v], &normals[v], reach, COVER_COS).map(|q| q as usize);
        hit.is_some_and(|q| cloud.samples.weights[q] > 0.5 * cloud.samples.areas[q])
    };
    (0..points.len()).into_par_iter().with_min_len(128).map(is_seen).collect()
}
