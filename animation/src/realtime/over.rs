//! A garment that is kept over one of the layers below it.
//!
//! Each vertex knows the triangle of the lower layer that it stood over in the last frame, at first in the scan. It walks from there to
//! where it stands now, which takes no search, and is lifted where it is lower than it must be. Then the middles of the garment's edges: a
//! ridge of the lower layer is sharper than the triangles over it. A vertex that has lost its way begins where it stood in the scan.

use nalgebra::{Point3, Vector3, center};
use rayon::prelude::*;
use toile_geometry::{
    Mesh,
    bvh::{Bvh, Closest},
};

use super::{
    hit::DEEPEST,
    lifts::Lifts,
    surface::{Foot, NONE, Surface},
};
use crate::blend::anchors::NEAR;

/// Least height over a lower layer, metres, where the scan had as much: three quarters of what layers have at rest.
const GAP: f32 = 0.0012;
/// Vertices look for lower layers within this distance in the outfit's first pose, metres.
const REACH: f32 = 0.10;
/// Beside a rim of a lower layer, vertices up to this far from it can come over it, metres: layers slide on each other by less.
const BESIDE: f32 = 0.03;
/// Cosine between the normals of a vertex and of what it stands over: what faces elsewhere is the far side of a fold.
const FACING: f32 = 0.5;
/// Edges with both ends higher than this, metres, have nothing to do with ridges below: half the edge of a triangle of a scan (5 mm) over
/// a ridge that is bent by a right angle.
const HIGH: f32 = 0.0025;
/// What comes through farther than that has another foot.
const FARTHEST: f32 = 3.0 * HIGH;
/// Vertices or edges in a parallel chunk.
const CHUNK: usize = 512;

/// Where the vertices of one layer stand over another.
pub(super) struct Over {
    /// Triangle that each vertex stood over in the last frame.
    seeds: Vec<u32>,
    /// The same in the outfit's first pose, or [`NONE`].
    homes: Vec<u32>,
    /// Height that each vertex keeps, metres.
    gaps: Vec<f32>,
    /// Height of each vertex in this frame, metres; infinite where it stands over nothing.
    heights: Vec<f32>,
}

impl Over {
    /// For an `upper` layer whose vertices have `normals` and are, or are not, part of a `hem`, over a `lower` one.
    pub fn new(
        upper: &Mesh,
        (normals, hem): (&[Vector3<f32>], &[bool]),
        (lower, surface, bvh): (&Mesh, &Surface, &Bvh),
    ) -> Self {
        let stand = |((p, normal), hem): ((&Point3<f32>, &Vector3<f32>), &bool)| {
            let Some(hit) = bvh.closest(p, REACH) else { return (NONE, 0.0) };
            let facing = if hit.distance > NEAR as f32 { FACING } else { 0.0 };
            // Hems roll in.
            let faces = |n: &Vector3<f32>| *hem || n.dot(normal) > facing;
            let mut seed = hit.triangle;
            match surface.foot(&lower.positions, p, &mut seed) {
                Some(foot) if foot.height > 0.0 && faces(&foot.normal) => (seed, foot.height.min(GAP)),
                // Beside a rim, it may come over the lower layer later.
                None if hit.distance < BESIDE && over_plane(lower, &hit, p).is_some_and(|n| faces(&n)) => {
                    (hit.triangle, GAP)
                }
                _ => (NONE, 0.0),
            }
        };
        let vertices = upper.positions.par_iter().zip(normals).zip(hem);
        let (homes, gaps): (Vec<u32>, Vec<f32>) = vertices.map(stand).unzip();
        Self { seeds: homes.clone(), heights: vec![f32::INFINITY; homes.len()], homes, gaps }
    }

    /// Lifts each of the upper layer's `points` that is lower over the `surface`, whose vertices are at `places`, than it must be. Those that
    /// `stand` over a layer between are left, and those that stand over this one are marked.
    pub fn lift_points(
        &mut self,
        (points, stand): (&mut [Point3<f32>], &mut [bool]),
        surface: &Surface,
        places: &[Point3<f32>],
    ) {
        let Self { seeds, homes, gaps, heights } = self;
        let feet = seeds.par_iter_mut().zip(homes).zip(gaps).zip(heights);
        let points = points.par_iter_mut().zip(stand).zip(feet).with_min_len(CHUNK);
        points.for_each(|((p, stands), (((seed, home), gap), height))| {
            *height = f32::INFINITY;
            if *stands {
                return;
            }
            if let Some(foot) = walk(surface, places, p, seed, *home) {
                *p += foot.normal * (*gap - foot.height).max(0.0);
                *height = foot.height.max(*gap);
                *stands = true;
            }
        });
    }

    /// Lifts the ends of the upper layer's `edges` whose middles are lower than half the gap.
    pub fn lift_edges(
        &self,
        points: &mut [Point3<f32>],
        edges: &mut [[u32; 2]],
        (surface, places): (&Surface, &[Point3<f32>]),
        lifts: &mut Lifts,
    ) {
        let above = &*points;
        let by = |[a, b]: [usize; 2]| {
            let (low, high) = (self.heights[a].min(self.heights[b]), self.heights[a].max(self.heights[b]));
            if low > HIGH || high > FARTHEST {
                return None;
            }
            let foot = surface.foot(places, &center(&above[a], &above[b]), &mut self.seeds[a].clone())?;
            let is_through = foot.height < 0.5 * GAP && foot.height > -FARTHEST;
            is_through.then(|| foot.normal * (GAP - foot.height))
        };
        lifts.find(edges, |ends| by(ends.map(|v| v as usize)).unwrap_or_else(Vector3::zeros));
        lifts.apply(edges, |ends| *ends, points);
    }
}

/// The foot of `p`, walking from `seed`; from `home` again in the next frame where it is lost or on the other side of a fold.
#[inline]
fn walk(surface: &Surface, places: &[Point3<f32>], p: &Point3<f32>, seed: &mut u32, home: u32) -> Option<Foot> {
    if home == NONE {
        return None;
    }
    let foot = surface.foot(places, p, seed).filter(|foot| foot.height > -DEEPEST);
    if foot.is_none() {
        *seed = home;
    }
    foot
}

/// Unit normal of the triangle that is nearest to `p`, where `p` lies over its plane.
fn over_plane(mesh: &Mesh, hit: &Closest, p: &Point3<f32>) -> Option<Vector3<f32>> {
    let [a, b, c] = mesh.corners(hit.triangle as usize);
    let normal = (b - a).cross(&(c - a)).try_normalize(1e-12)?;
    ((p - a).dot(&normal) > 0.0).then_some(normal)
}
