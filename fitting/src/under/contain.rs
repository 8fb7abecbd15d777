//! The posed body drawn inside the scan of a dressed take.
//!
//! Skin that lies over the scan is moved inward along its normal: all of it, however far, where the scan was seen and the
//! flesh is thick enough. What stays outside (thin parts, lips and lids, skin over holes of the scan, skin without scan of
//! its own side within 5 cm) is counted and reported. Hands and feet are finer than what a scan shows of them (fingers
//! and toes melt together), so they keep the model's form and are drawn in by the uncertainty of their position. Where
//! cloth stands off skin lies deeper already and stays. The pockets of mouth and eyes, which no scanner sees, are drawn
//! back into the flesh; the lips before them stay.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_character::{BodyModel, Region};
use toile_geometry::{
    Mesh,
    bvh::Bvh,
    mesh::vertex_normals,
    statistics::{Rank, quantile_of_sorted},
    topology::VertexNeighbors,
};

use super::inside::Inside;
use crate::{
    conform::{uncrossed, unfolded},
    surface::{Nearby, ScanSurface},
};

/// Inside the scan, surface farther than this is cloth or another finger and does not move a vertex, metres.
const REACH: f32 = 0.008;
/// Outside of it, surface of the same side within this draws a vertex in, metres: a sleeve's width.
const REACH_OUTSIDE: f32 = 0.05;
/// Smallest cosine between the normals of body and scan.
const MIN_COS: f32 = 0.3;
/// Smallest trust of a scan point that a vertex must stay inside of.
const SEEN: f32 = 0.5;
/// How far hands and feet are drawn in, in standard deviations of the distance left between them and this scan.
const DRAWN_IN: f32 = 1.5;
/// Smallest number of seen vertices that such a deviation is taken from.
const FEWEST: usize = 30;
/// Largest height that one round believes of a vertex that the scan's inside contains, metres: the noise of a scan.
const BELIEVED: f32 = 0.002;
/// Rounds of moving with fresh nearest points.
const ROUNDS: usize = 2;
/// Farthest that a vertex moves by believed heights and margins, metres: noise in every round.
const BY_NOISE: f32 = 0.004;
/// Farthest that a vertex outside moves, metres, and as a share of the body's thickness there: both sides of a limb may move.
const FARTHEST: f32 = 0.03;
const OF_THICKNESS: f32 = 0.3;
/// Skin nearer to a pocket than this (lips, lids) does not move, metres.
const RIM: f32 = 0.005;
/// Rounds of averaging over neighbours that make dents soft.
const SOFTENED: usize = 6;
/// How far pockets are drawn back, metres, and as a share of the flesh there is.
const POCKET: f32 = 0.008;
const OF_FLESH: f32 = 0.8;

/// The vertices of the body (template topology) moved inside `scan`, along the normals they start with.
pub(crate) fn contained(
    model: &BodyModel,
    start: &[Point3<f32>],
    (scan, trust): (&Mesh, &[f32]),
    inside: &Inside,
) -> Vec<Point3<f32>> {
    let surface = ScanSurface::new(scan, trust, inside.bvh());
    let neighbors = VertexNeighbors::new(start.len(), &model.triangles);
    let normals = vertex_normals(start, &model.triangles);
    let most = farthest(model, start, &normals);
    let mut depth = Depth::new(start.len());
    let mut points = start.to_vec();
    let mut margins = None;
    for _ in 0..ROUNDS {
        let heights = heights(model, &surface, &points, &normals, REACH);
        let is_first = margins.is_none();
        let margins = margins.get_or_insert_with(|| Margins::new(model, &heights));
        for (v, height) in heights.iter().enumerate() {
            let margin = margins.of(model.regions[v]);
            let unseen = if is_first { margin } else { 0.0 };
            depth.by_noise[v] += height.map_or(unseen, |h| (h.min(BELIEVED) + margin).max(0.0));
        }
        draw_in(model, &surface, inside, &points, &normals, &mut depth.astray);
        depth.soften(&neighbors, &most);
        points = (0..start.len()).map(|v| start[v] - normals[v] * depth.of(v, &most)).collect();
    }
    draw_pockets_back(model, &mut points);
    uncrossed(&model.triangles, start, unfolded(model, start, points))
}

/// How deep each vertex is moved along its normal, metres.
struct Depth {
    /// For heights that noise explains, and for the margins of hands and feet.
    by_noise: Vec<f32>,
    /// For what lies outside by more than that.
    astray: Vec<f32>,
}

impl Depth {
    fn new(count: usize) -> Self {
        Self { by_noise: vec![0.0; count], astray: vec![0.0; count] }
    }

    /// Lets both fade out over the neighbours, at most `most` deep, and not deeper by noise than noise reaches.
    fn soften(&mut self, neighbors: &VertexNeighbors, most: &[f32]) {
        for (depth, limit) in [(&mut self.by_noise, BY_NOISE), (&mut self.astray, FARTHEST)] {
            soften(depth, neighbors);
            depth.iter_mut().zip(most).for_each(|(d, m)| *d = d.min(m.min(limit)));
        }
    }

    fn of(&self, v: usize, most: &[f32]) -> f32 {
        (self.by_noise[v] + self.astray[v]).min(most[v])
    }
}

/// Adds to the depth of each vertex outside the scan its height over it.
fn draw_in(
    model: &BodyModel,
    surface: &ScanSurface,
    inside: &Inside,
    points: &[Point3<f32>],
    normals: &[Vector3<f32>],
    depth: &mut [f32],
) {
    let outside: Vec<usize> = (0..points.len()).zip(inside.is_outside(points)).filter(|o| o.1).map(|o| o.0).collect();
    let heights: Vec<Option<f32>> =
        outside.par_iter().map(|&v| height(model, surface, points, normals, v, REACH_OUTSIDE)).collect();
    for (v, height) in outside.into_iter().zip(heights) {
        // what lies beyond the believed part was not added yet
        depth[v] += height.map_or(0.0, |h| (h - BELIEVED).max(0.0));
    }
}

/// How deep below the scan the vertices of hands and feet have to lie, metres: the uncertainty of their place, measured on
/// this scan.
#[derive(Default)]
struct Margins {
    extremities: [f32; Region::ALL.len()],
}

impl Margins {
    fn new(model: &BodyModel, heights: &[Option<f32>]) -> Self {
        let mut margins = Self::default();
        for region in [Region::LeftHand, Region::RightHand, Region::LeftFoot, Region::RightFoot] {
            let of_region = heights.iter().zip(&model.regions).filter(|(_, r)| **r == region);
            let mut heights: Vec<f32> = of_region.filter_map(|(h, _)| *h).collect();
            if heights.len() >= FEWEST {
                heights.sort_by(f32::total_cmp);
                let at = |share| quantile_of_sorted(&heights, share, Rank::Below).unwrap_or_default();
                // half of the middle 68 %: a standard deviation that stray points do not move
                margins.extremities[region as usize] = DRAWN_IN * 0.5 * (at(0.84) - at(0.16));
            }
        }
        margins
    }

    fn of(&self, region: Region) -> f32 {
        self.extremities[region as usize]
    }
}

/// How far each vertex may move: not through a thin part, lips and lids and their pockets not at all.
fn farthest(model: &BodyModel, points: &[Point3<f32>], normals: &[Vector3<f32>]) -> Vec<f32> {
    let bvh = Bvh::new(points, &model.triangles);
    let pockets = Nearby::new(points.iter().zip(&model.inner).filter(|(_, inner)| **inner).map(|(p, _)| *p));
    let most = |v: usize| {
        let from = points[v] - normals[v] * 1e-4;
        let thickness = bvh.ray(&from, &-normals[v], FARTHEST / OF_THICKNESS).map_or(f32::INFINITY, |h| h.t);
        let rim = pockets.as_ref().map_or(f32::INFINITY, |c| c.distance(&points[v]) - RIM);
        if model.inner[v] { 0.0 } else { (OF_THICKNESS * thickness).min(FARTHEST).min(0.5 * rim.max(0.0)) }
    };
    (0..points.len()).into_par_iter().with_min_len(128).map(most).collect()
}

/// Height of each outer vertex over the scan, metres, negative inside; `None` where nothing was seen within `reach`.
fn heights(
    model: &BodyModel,
    surface: &ScanSurface,
    points: &[Point3<f32>],
    normals: &[Vector3<f32>],
    reach: f32,
) -> Vec<Option<f32>> {
    let height = |v: usize| height(model, surface, points, normals, v, reach);
    (0..points.len()).into_par_iter().with_min_len(128).map(height).collect()
}

fn height(
    model: &BodyModel,
    surface: &ScanSurface,
    points: &[Point3<f32>],
    normals: &[Vector3<f32>],
    v: usize,
    reach: f32,
) -> Option<f32> {
    if model.inner[v] {
        return None;
    }
    let contact = surface.nearest(&points[v], &normals[v], reach, MIN_COS)?;
    let is_seen = contact.trust >= SEEN && !contact.is_rim(&contact.normal);
    is_seen.then(|| contact.offset.dot(&contact.normal))
}

/// A dent fades out over the neighbours instead of ending in a step.
fn soften(depth: &mut Vec<f32>, neighbors: &VertexNeighbors) {
    for _ in 0..SOFTENED {
        let mean = |v: usize| {
            let around = neighbors.of(v);
            around.iter().map(|&n| depth[n as usize]).sum::<f32>() / around.len().max(1) as f32
        };
        *depth = (0..depth.len()).map(|v| depth[v].max(mean(v))).collect();
    }
}

/// Moves the walls of mouth and eye pockets away from their hollow.
fn draw_pockets_back(model: &BodyModel, points: &mut [Point3<f32>]) {
    let skin = (0..points.len()).filter(|&v| !model.inner[v]).map(|v| points[v]);
    let Some(skin) = Nearby::new(skin) else { return };
    let normals = vertex_normals(points, &model.triangles);
    for v in (0..points.len()).filter(|&v| model.inner[v]) {
        let flesh = skin.distance(&points[v]);
        points[v] -= normals[v] * (OF_FLESH * flesh).min(POCKET);
    }
}
