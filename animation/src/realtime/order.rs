//! Layers that keep their order.
//!
//! Each vertex of a garment knows the triangle of each lower layer that it stood over in the scan. In each frame it walks from there
//! to where it stands now, which takes no search and depends on no other frame, and is lifted where it is lower than it must be.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_geometry::{Mesh, bvh::Bvh};

use super::{
    hit::DEEPEST,
    surface::{Foot, NONE, Surface},
};
use crate::blend::anchors::NEAR;

/// Least height over a lower layer, metres, where the scan had as much: three quarters of what layers have at rest.
const GAP: f32 = 0.0012;
/// Vertices look for lower layers within this distance in the outfit's first pose, metres.
const REACH: f32 = 0.10;
/// Cosine between the normals of a vertex and of what it stands over: what faces elsewhere is the far side of a fold.
const FACING: f32 = 0.5;
/// Vertices in a parallel chunk.
const CHUNK: usize = 512;

/// Where the vertices of all garments stand over the layers below.
pub(super) struct Order {
    surfaces: Vec<Surface>,
    /// For each garment, for each layer below, inside to outside.
    over: Vec<Vec<Over>>,
}

/// Where the vertices of one layer stand over another.
struct Over {
    /// Triangle that each vertex stood over in the last frame.
    seeds: Vec<u32>,
    /// The same in the outfit's first pose, or [`NONE`].
    homes: Vec<u32>,
    /// Height that each vertex keeps, metres.
    gaps: Vec<f32>,
}

impl Order {
    /// For `layers` in the outfit's first pose, inside to outside.
    pub fn new(layers: &[&Mesh]) -> Self {
        let surfaces: Vec<Surface> = layers.iter().map(|l| Surface::new(&l.triangles)).collect();
        let bvhs: Vec<Bvh> = layers.iter().map(|l| Bvh::new(&l.positions, &l.triangles)).collect();
        let of = |k: usize| {
            let normals = layers[k].vertex_normals();
            (0..k).map(|j| Over::new(layers[k], &normals, layers[j], &surfaces[j], &bvhs[j])).collect()
        };
        let over = (1..layers.len()).map(of).collect();
        Self { surfaces, over }
    }

    /// Lifts the vertices of garment `k` of `layers` (from 1) over all layers below.
    pub fn keep(&mut self, layers: &mut [Vec<Point3<f32>>], k: usize) {
        let (below, rest) = layers.split_at_mut(k);
        for (j, over) in self.over[k - 1].iter_mut().enumerate() {
            over.lift(&mut rest[0], &self.surfaces[j], &below[j]);
        }
    }
}

impl Over {
    fn new(upper: &Mesh, normals: &[Vector3<f32>], lower: &Mesh, surface: &Surface, bvh: &Bvh) -> Self {
        let stand = |(p, normal): (&Point3<f32>, &Vector3<f32>)| {
            let Some(hit) = bvh.closest(p, REACH) else { return (NONE, 0.0) };
            let mut seed = hit.triangle;
            let facing = if hit.distance > NEAR as f32 { FACING } else { 0.0 };
            match surface.foot(&lower.positions, p, &mut seed) {
                Some(foot) if foot.height > 0.0 && foot.normal.dot(normal) > facing => (seed, foot.height.min(GAP)),
                // Beside a rim there is nothing to stand on.
                _ => (NONE, 0.0),
            }
        };
        let (homes, gaps): (Vec<u32>, Vec<f32>) = upper.positions.par_iter().zip(normals).map(stand).unzip();
        Self { seeds: homes.clone(), homes, gaps }
    }

    /// Lifts each of the upper layer's `points` that is lower over the surface than it must be.
    fn lift(&mut self, points: &mut [Point3<f32>], surface: &Surface, places: &[Point3<f32>]) {
        let Self { seeds, homes, gaps } = self;
        let chunks = points
            .par_chunks_mut(CHUNK)
            .zip(seeds.par_chunks_mut(CHUNK))
            .zip(homes.par_chunks(CHUNK))
            .zip(gaps.par_chunks(CHUNK));
        chunks.for_each(|(((points, seeds), homes), gaps)| {
            for (k, p) in points.iter_mut().enumerate() {
                let Some(foot) = walk(surface, places, p, &mut seeds[k], homes[k]) else { continue };
                if foot.height < gaps[k] {
                    *p += foot.normal * (gaps[k] - foot.height);
                }
            }
        });
    }
}

/// The foot of `p`, walking from `seed`; from `home` again in the next frame where it is lost or on the other side of a fold.
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
