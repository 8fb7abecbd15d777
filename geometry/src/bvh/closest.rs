//! The closest point of a mesh.

use std::ops::Range;

use nalgebra::Point3;

use super::{traverse::Query, tree::Node, triangles::Bvh};
use crate::triangle;

/// The closest point of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closest {
    /// Triangle index.
    pub triangle: u32,
    /// Barycentric coordinates in it.
    pub barycentric: [f32; 3],
    /// The point itself.
    pub point: Point3<f32>,
    /// Distance from the query, metres.
    pub distance: f32,
}

impl Bvh {
    /// The closest point within `max_distance`, or `None`. Of equally near triangles the first visited wins.
    pub fn closest(&self, p: &Point3<f32>, max_distance: f32) -> Option<Closest> {
        self.closest_where(p, max_distance, |_| true)
    }

    /// The closest point on a triangle that `accept` takes, within `max_distance`.
    pub fn closest_where(&self, p: &Point3<f32>, max_distance: f32, accept: impl Fn(u32) -> bool) -> Option<Closest> {
        let mut search = Search { bvh: self, p: *p, accept, limit: max_distance * max_distance, best: None };
        self.tree.traverse(&mut search);
        let (place, barycentric) = search.best?;
        let [a, b, c] = &self.corners[place];
        Some(Closest {
            triangle: self.tree.order[place],
            barycentric,
            point: triangle::at(barycentric, a, b, c),
            distance: search.limit.sqrt(),
        })
    }
}

struct Search<'a, F> {
    bvh: &'a Bvh,
    p: Point3<f32>,
    accept: F,
    /// Squared distance of the best so far, or the largest allowed.
    limit: f32,
    /// Place in the order and barycentric coordinates.
    best: Option<(usize, [f32; 3])>,
}

impl<F: Fn(u32) -> bool> Query for Search<'_, F> {
    #[inline(always)]
    fn rank(&self, node: &Node) -> f32 {
        node.distance_squared(&self.p)
    }

    #[inline(always)]
    fn wants(&self, rank: f32) -> bool {
        !(rank > self.limit || (rank == self.limit && self.best.is_some()))
    }

    #[inline(always)]
    fn visit(&mut self, places: Range<usize>) {
        for place in places {
            if !(self.accept)(self.bvh.tree.order[place]) {
                continue;
            }
            let [a, b, c] = &self.bvh.corners[place];
            let w = triangle::closest_barycentric(&self.p, a, b, c);
            let squared = (triangle::at(w, a, b, c) - self.p).norm_squared();
            if squared < self.limit || (squared <= self.limit && self.best.is_none()) {
                (self.limit, self.best) = (squared, Some((place, w)));
            }
        }
    }
}
