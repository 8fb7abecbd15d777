//! Vertices of a lower layer that come through the layer above them.
//!
//! A vertex of a fold can stand between the vertices of the layer above. Each knows the triangle that it stood under in the scan and
//! walks along under that layer; where it comes through, the triangle is lifted.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_geometry::{Mesh, bvh::Bvh};

use super::{lifts::Lifts, surface::Surface};

/// Vertices look for the upper layer within this distance in the outfit's first pose, metres: those that lie under it, with the air that
/// loose cloth leaves.
const REACH: f32 = 0.03;
/// Cosine between the normals of a vertex and of the triangle over it: what faces elsewhere is the other side of a fold.
const FACING: f32 = 0.5;
/// What is left over a vertex that came through, metres: a cloth's thickness.
const GAP: f32 = 0.0003;
/// What comes through farther than this has another place to be, metres: a vertex amid a triangle of 5 mm cannot stand higher over its plane
/// without having neighbours that do.
const FARTHEST: f32 = 0.006;
/// The vertices of a lower layer that stand under an upper one.
pub(super) struct Through {
    under: Vec<Under>,
}

/// A layer in the outfit's first pose.
type Worn<'l> = (&'l Mesh, &'l Surface, &'l Bvh);

/// A vertex of the lower layer.
struct Under {
    vertex: u32,
    /// Triangle that it stood under in the last frame, and in the outfit's first pose.
    seed: u32,
    home: u32,
}

impl Through {
    /// For the vertices of a `lower` layer with these `normals` in the outfit's first pose that stand under the last of the layers `above` it,
    /// inside to outside, and under none of the others: those keep what lies under them from the last.
    pub fn new<'l>((lower, _, _): Worn<'l>, normals: &[Vector3<f32>], above: impl Iterator<Item = Worn<'l>>) -> Self {
        let above: Vec<Worn> = above.collect();
        let home = |(upper, surface, bvh): &Worn, v: usize| {
            let p = &lower.positions[v];
            let mut home = bvh.closest(p, REACH)?.triangle;
            let foot = surface.foot(&upper.positions, p, &mut home)?;
            (foot.height < 0.0 && foot.normal.dot(&normals[v]) > FACING).then_some(home)
        };
        let stand = |v: usize| {
            let (last, between) = above.split_last()?;
            let home = home(last, v).filter(|_| between.iter().all(|layer| home(layer, v).is_none()))?;
            Some(Under { vertex: v as u32, seed: home, home })
        };
        Self { under: (0..lower.positions.len()).into_par_iter().filter_map(stand).collect() }
    }

    /// How many vertices stand under the upper layer.
    pub fn count(&self) -> usize {
        self.under.len()
    }

    /// Lifts the upper layer's `points` over the vertices of the `lower` one, which lie at `places`.
    pub fn lift(
        &mut self,
        (points, surface): (&mut [Point3<f32>], &Surface),
        (places, lower): (&[Point3<f32>], &Surface),
        lifts: &mut Lifts,
    ) {
        let above = &*points;
        lifts.find(&mut self.under, |u| u.lift((surface, above), (lower, places)));
        lifts.apply(&self.under, |u| surface.triangles[u.seed as usize], points);
    }
}

impl Under {
    /// How the triangle over the vertex has to move, metres, where the layers' vertices are `above` and at `places`.
    fn lift(
        &mut self,
        (surface, above): (&Surface, &[Point3<f32>]),
        (lower, places): (&Surface, &[Point3<f32>]),
    ) -> Vector3<f32> {
        let v = self.vertex as usize;
        let foot = surface.foot(above, &places[v], &mut self.seed).filter(|f| f.height > -REACH && f.height < FARTHEST);
        let Some(foot) = foot else {
            self.seed = self.home;
            return Vector3::zeros();
        };
        let is_through = foot.height > -GAP && foot.normal.dot(&lower.vertex_normal(places, v)) > FACING;
        if is_through { foot.normal * (foot.height + GAP) } else { Vector3::zeros() }
    }
}
