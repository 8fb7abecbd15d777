//! The nodes of a hierarchy: boxes around items that somebody else holds.

use std::ops::Range;

use nalgebra::Point3;

/// A box around everything below it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Node {
    pub(crate) lo: Point3<f32>,
    pub(crate) hi: Point3<f32>,
    /// Leaf: first place in the order. Inner node: index of the right child (the left one follows its parent).
    pub(super) start: u32,
    /// Leaf: number of items. Inner node: 0.
    pub(super) count: u32,
}

impl Node {
    pub(super) const EMPTY: Self =
        Self { lo: Point3::new(0.0, 0.0, 0.0), hi: Point3::new(0.0, 0.0, 0.0), start: 0, count: 0 };

    /// Squared distance from a point to the box, 0 inside.
    #[inline(always)]
    pub(crate) fn distance_squared(&self, p: &Point3<f32>) -> f32 {
        let mut sum = 0.0;
        for k in 0..3 {
            let d = (self.lo[k] - p[k]).max(p[k] - self.hi[k]).max(0.0);
            sum += d * d;
        }
        sum
    }

    /// Places in the order of a leaf's items; empty for an inner node.
    #[inline]
    pub(super) fn items(&self) -> Range<usize> {
        self.start as usize..(self.start + self.count) as usize
    }

    /// Indices of the two children of inner node `index`.
    #[inline]
    pub(super) fn children(&self, index: u32) -> [u32; 2] {
        [index + 1, self.start]
    }
}

/// Nodes, parents before children, and the order of the items in the leaves.
#[derive(Debug, Clone)]
pub(crate) struct Tree {
    pub(crate) nodes: Vec<Node>,
    /// Item at each place of the order.
    pub(crate) order: Vec<u32>,
}

impl Tree {
    /// Fits all boxes to the items' bounds; `bounds(place)` gives those of the item at a place of the order. O(n).
    pub(crate) fn refit(&mut self, bounds: impl Fn(usize) -> (Point3<f32>, Point3<f32>)) {
        // Children follow their parents: leaves come first from behind.
        for n in (0..self.nodes.len()).rev() {
            let node = &self.nodes[n];
            let (lo, hi) = if node.count > 0 {
                let all = node.items().map(&bounds);
                all.fold(
                    ([f32::INFINITY; 3].into(), [f32::NEG_INFINITY; 3].into()),
                    |(lo, hi): (Point3<f32>, Point3<f32>), (l, h)| (lo.inf(&l), hi.sup(&h)),
                )
            } else {
                let [l, r] = node.children(n as u32).map(|c| &self.nodes[c as usize]);
                (l.lo.inf(&r.lo), l.hi.sup(&r.hi))
            };
            (self.nodes[n].lo, self.nodes[n].hi) = (lo, hi);
        }
    }
}
