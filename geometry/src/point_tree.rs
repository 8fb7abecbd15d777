//! The nearest of many points that fulfils a condition: points in the same hierarchy as triangles ([`crate::bvh`]).

use std::ops::Range;

use nalgebra::Point3;

use crate::bvh::{
    build,
    traverse::Query,
    tree::{Node, Tree},
};

/// Maximum number of points in a leaf.
const LEAF: usize = 8;

/// Points arranged for nearest-point queries.
#[derive(Debug, Clone)]
pub struct PointTree {
    tree: Tree,
    /// The points, in the tree's order.
    points: Vec<Point3<f32>>,
}

impl PointTree {
    /// Arranges the points; coordinates must be finite. The same for any number of threads. O(n log n).
    pub fn new(points: &[Point3<f32>]) -> Self {
        let mut tree = build::divide(points, LEAF);
        let points: Vec<Point3<f32>> = tree.order.iter().map(|&i| points[i as usize]).collect();
        tree.refit(|place| (points[place], points[place]));
        Self { tree, points }
    }

    /// Index of the nearest point within `max_distance` (metres) that `accept` takes, and its squared distance. Of equally
    /// near points the first visited wins.
    pub fn nearest(&self, p: &Point3<f32>, max_distance: f32, accept: impl Fn(u32) -> bool) -> Option<(u32, f32)> {
        let mut search = Search { tree: self, p: *p, accept, limit: max_distance * max_distance, best: None };
        self.tree.traverse(&mut search);
        Some((search.best?, search.limit))
    }
}

struct Search<'a, F> {
    tree: &'a PointTree,
    p: Point3<f32>,
    accept: F,
    /// Squared distance of the best so far, or the largest allowed.
    limit: f32,
    best: Option<u32>,
}

impl<F: Fn(u32) -> bool> Query for Search<'_, F> {
    #[inline]
    fn rank(&self, node: &Node) -> f32 {
        node.distance_squared(&self.p)
    }

    #[inline]
    fn wants(&self, rank: f32) -> bool {
        !(rank > self.limit || (rank == self.limit && self.best.is_some()))
    }

    #[inline]
    fn visit(&mut self, places: Range<usize>) {
        for place in places {
            let squared = (self.tree.points[place] - self.p).norm_squared();
            let nearer = squared < self.limit || (squared == self.limit && self.best.is_none());
            let item = self.tree.tree.order[place];
            if nearer && (self.accept)(item) {
                (self.limit, self.best) = (squared, Some(item));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_accepted_point_agrees_with_brute_force() {
        let number = |i: u32, k: u32| ((i * 7919 + k * 104_729) % 2003) as f32 / 2003.0;
        for count in [1, 8, 9, 100, 5000] {
            let points: Vec<_> = (0..count).map(|i| Point3::new(number(i, 1), number(i, 2), number(i, 3))).collect();
            let tree = PointTree::new(&points);
            for q in 0..200 {
                let p = Point3::new(number(q, 5), number(q, 6), 1.2 * number(q, 7));
                let accept = |i: u32| i % 3 != q % 3;
                let all = (0..count).filter(|&i| accept(i)).map(|i| (points[i as usize] - p).norm_squared());
                let brute = all.filter(|d| *d <= 0.04).fold(f32::INFINITY, f32::min);
                let found = tree.nearest(&p, 0.2, accept);
                assert_eq!(found.map_or(f32::INFINITY, |f| f.1), brute, "{count} points, query {q}");
                assert!(found.is_none_or(|f| accept(f.0) && (points[f.0 as usize] - p).norm_squared() == f.1));
            }
        }
        assert!(PointTree::new(&[]).nearest(&Point3::origin(), 1.0, |_| true).is_none());
    }
}
