//! Where a ray meets a mesh.

use std::ops::Range;

use nalgebra::{Point3, Vector3};

use super::{traverse::Query, tree::Node, triangles::Bvh};
use crate::triangle;

/// Where a ray meets a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayHit {
    /// Triangle index.
    pub triangle: u32,
    /// Barycentric coordinates in it.
    pub barycentric: [f32; 3],
    /// Ray parameter: metres where the direction is a unit vector.
    pub t: f32,
}

impl Bvh {
    /// The first hit of the ray with `t` in `[0, max_t]`, from either side.
    pub fn ray(&self, origin: &Point3<f32>, direction: &Vector3<f32>, max_t: f32) -> Option<RayHit> {
        self.ray_where(origin, direction, max_t, |_| true)
    }

    /// The first hit, as [`Bvh::ray`], of a triangle that `accept` takes.
    pub fn ray_where(
        &self,
        origin: &Point3<f32>,
        direction: &Vector3<f32>,
        max_t: f32,
        accept: impl Fn(u32) -> bool,
    ) -> Option<RayHit> {
        let (origin, direction, inverse) = (*origin, *direction, direction.map(|d| 1.0 / d));
        let mut cast = Cast { bvh: self, origin, direction, inverse, accept, limit: max_t, best: None };
        self.tree.traverse(&mut cast);
        cast.best
    }
}

struct Cast<'a, F> {
    bvh: &'a Bvh,
    origin: Point3<f32>,
    direction: Vector3<f32>,
    inverse: Vector3<f32>,
    accept: F,
    /// Ray parameter of the best hit so far, or the largest allowed.
    limit: f32,
    best: Option<RayHit>,
}

impl<F: Fn(u32) -> bool> Query for Cast<'_, F> {
    /// Ray parameter at which the box is entered, infinite where it is missed.
    #[inline(always)]
    fn rank(&self, node: &Node) -> f32 {
        let (mut enter, mut leave) = (0.0f32, self.limit);
        for k in 0..3 {
            let low = (node.lo[k] - self.origin[k]) * self.inverse[k];
            let high = (node.hi[k] - self.origin[k]) * self.inverse[k];
            enter = enter.max(low.min(high));
            leave = leave.min(low.max(high));
        }
        // Rounding must not lose a hit on the side of a box.
        if enter <= leave * (1.0 + 1e-5) { enter } else { f32::INFINITY }
    }

    #[inline(always)]
    fn wants(&self, enter: f32) -> bool {
        enter <= self.limit && enter.is_finite()
    }

    #[inline(always)]
    fn visit(&mut self, places: Range<usize>) {
        for place in places {
            if !(self.accept)(self.bvh.tree.order[place]) {
                continue;
            }
            let hit = triangle::ray_hit(&self.origin, &self.direction, &self.bvh.corners[place]);
            if let Some((t, barycentric)) = hit.filter(|h| h.0 <= self.limit) {
                self.limit = t;
                self.best = Some(RayHit { triangle: self.bvh.tree.order[place], barycentric, t });
            }
        }
    }
}
