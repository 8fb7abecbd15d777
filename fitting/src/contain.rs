//! The posed body drawn inside the scan of a dressed take: no skin over the surface that was seen.
//!
//! Skin that follows the scan of the first take is moved inward where it lies over this one. Hands and feet are finer
//! than what a scan shows of them (fingers and toes melt together), so they keep the model's form and are drawn in by
//! what their position is unsure. Where cloth stands off skin lies deeper already and stays. The pockets of mouth and
//! eyes, which no scanner sees, are drawn back into the flesh; the lips before them stay.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_character::{BodyModel, Region};
use toile_geometry::{Mesh, bvh::Bvh, mesh::vertex_normals, topology::VertexNeighbors};

use crate::{cloud::Nearby, conform::unfolded, uncross::uncrossed};

/// Scan farther than this says nothing of a vertex, metres: cloth, or another finger.
const REACH: f32 = 0.008;
/// Least cosine between the normals of body and scan.
const MIN_COS: f32 = 0.3;
/// Least trust of a scan point that a vertex must stay inside of.
const SEEN: f32 = 0.5;
/// How far hands and feet are drawn in, in standard deviations of what is left between them and this scan.
const DRAWN_IN: f32 = 1.5;
/// Fewest seen vertices that such a deviation is taken from.
const FEWEST: usize = 30;
/// Most that one round believes of a height over the scan, metres.
const BELIEVED: f32 = 0.002;
/// Rounds of moving with fresh nearest points.
const ROUNDS: usize = 2;
/// Farthest that a vertex moves, metres, and as a part of the body's thickness there.
const FARTHEST: f32 = 0.004;
const OF_THICKNESS: f32 = 0.3;
/// Skin nearer to a pocket than this (lips, lids) does not move, metres.
const RIM: f32 = 0.005;
/// Rounds of averaging over neighbours that make dents soft.
const SOFTENED: usize = 6;
/// How far pockets are drawn back, metres, and as a part of the flesh there is.
const POCKET: f32 = 0.008;
const OF_FLESH: f32 = 0.8;

/// The vertices of the body (template topology) moved inside `scan`, along the normals they start with.
pub(crate) fn contained(model: &BodyModel, start: &[Point3<f32>], scan: &Mesh, trust: &[f32]) -> Vec<Point3<f32>> {
    let surface = Surface { scan, trust, bvh: Bvh::new(&scan.positions, &scan.triangles) };
    let neighbors = VertexNeighbors::new(start.len(), &model.triangles);
    let normals = vertex_normals(start, &model.triangles);
    let most = farthest(model, start, &normals);
    let mut depth = vec![0.0f32; start.len()];
    let mut points = start.to_vec();
    let mut margins = Margins::default();
    for round in 0..ROUNDS {
        let heights = surface.heights(model, &points, &normals);
        if round == 0 {
            margins = Margins::new(model, &heights);
        }
        for (v, height) in heights.iter().enumerate() {
            let margin = margins.of(model.regions[v]);
            let unseen = if round == 0 { margin } else { 0.0 };
            depth[v] += height.map_or(unseen, |h| (h.min(BELIEVED) + margin).max(0.0));
        }
        soften(&mut depth, &neighbors);
        depth.iter_mut().zip(&most).for_each(|(d, m)| *d = d.min(*m));
        points = (0..start.len()).map(|v| start[v] - normals[v] * depth[v]).collect();
    }
    draw_pockets_back(model, &mut points);
    uncrossed(&model.triangles, start, unfolded(model, start, points))
}

/// How deep below the scan the vertices of hands and feet have to lie, metres: how unsure their place is, measured on
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
                let at = |part: f32| heights[(part * (heights.len() - 1) as f32) as usize];
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

struct Surface<'a> {
    scan: &'a Mesh,
    trust: &'a [f32],
    bvh: Bvh,
}

impl Surface<'_> {
    /// Height of each outer vertex over the scan, metres, negative inside; `None` where nothing was seen near it.
    fn heights(&self, model: &BodyModel, points: &[Point3<f32>], normals: &[Vector3<f32>]) -> Vec<Option<f32>> {
        let height = |v: usize| if model.inner[v] { None } else { self.height(&points[v], &normals[v]) };
        (0..points.len()).into_par_iter().with_min_len(128).map(height).collect()
    }

    fn height(&self, p: &Point3<f32>, n: &Vector3<f32>) -> Option<f32> {
        let fits = |t: u32| self.normal(t).dot(n) > MIN_COS;
        let hit = self.bvh.closest_where(p, REACH, fits)?;
        let corners = self.scan.triangles[hit.triangle as usize];
        let trust: f32 = (0..3).map(|k| self.trust[corners[k] as usize] * hit.barycentric[k]).sum();
        let offset = p - hit.point;
        let height = offset.dot(&self.normal(hit.triangle));
        let slip = (offset.norm_squared() - height * height).max(0.0).sqrt();
        // far along the surface: the rim of a hole
        (trust >= SEEN && slip <= 0.3 * height.abs() + 0.002).then_some(height)
    }

    fn normal(&self, t: u32) -> Vector3<f32> {
        let [a, b, c] = self.scan.corners(t as usize);
        (b - a).cross(&(c - a)).try_normalize(1e-20).unwrap_or_default()
    }
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
