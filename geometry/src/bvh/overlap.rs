//! Triangles whose boxes overlap a box.

use std::ops::Range;

use nalgebra::Point3;

use super::{traverse::Query, tree::Node, triangles::Bvh};

impl Bvh {
    /// Calls `visit` with every triangle whose bounding box overlaps the box from `lo` to `hi`.
    pub fn overlapping(&self, lo: &Point3<f32>, hi: &Point3<f32>, visit: impl FnMut(u32)) {
        self.tree.traverse(&mut Overlap { bvh: self, lo: *lo, hi: *hi, report: visit });
    }
}

struct Overlap<'a, F> {
    bvh: &'a Bvh,
    lo: Point3<f32>,
    hi: Point3<f32>,
    report: F,
}

impl<F> Overlap<'_, F> {
    #[inline(always)]
    fn overlaps(&self, lo: &Point3<f32>, hi: &Point3<f32>) -> bool {
        (0..3).all(|k| lo[k] <= self.hi[k] && self.lo[k] <= hi[k])
    }
}

impl<F: FnMut(u32)> Query for Overlap<'_, F> {
    /// 0 where the box overlaps, else infinite.
    #[inline(always)]
    fn rank(&self, node: &Node) -> f32 {
        if self.overlaps(&node.lo, &node.hi) { 0.0 } else { f32::INFINITY }
    }

    #[inline(always)]
    fn wants(&self, rank: f32) -> bool {
        rank == 0.0
    }

    #[inline(always)]
    fn visit(&mut self, places: Range<usize>) {
        for place in places {
            let [a, b, c] = &self.bvh.corners[place];
            if self.overlaps(&a.inf(b).inf(c), &a.sup(b).sup(c)) {
                (self.report)(self.bvh.tree.order[place]);
            }
        }
    }
}
