//! Pairs of triangles of two hierarchies, or of one, whose boxes overlap.

use nalgebra::Point3;
use rayon::prelude::*;

use super::{
    tree::{Node, Tree},
    triangles::Bvh,
};

/// Pairs of boxes that are looked into side by side, at least, where there are so many.
const TASKS: usize = 256;

impl Bvh {
    /// All pairs (own triangle, triangle of `other`) whose boxes overlap and that pass `test`, ascending.
    pub fn pairs_with(&self, other: &Self, test: impl Fn(u32, u32) -> bool + Sync) -> Vec<[u32; 2]> {
        let overlap = |&[m, n]: &[u32; 2]| overlap(&self.tree.nodes[m as usize], &other.tree.nodes[n as usize]);
        let divide = |[m, n]: [u32; 2], into: &mut Vec<[u32; 2]>| {
            let (a, b) = (&self.tree.nodes[m as usize], &other.tree.nodes[n as usize]);
            // The larger box is divided.
            if b.count > 0 || (a.count == 0 && size(a) >= size(b)) {
                into.extend(a.children(m).map(|m| [m, n]).into_iter().filter(overlap));
            } else {
                into.extend(b.children(n).map(|n| [m, n]).into_iter().filter(overlap));
            }
        };
        let leaf = |[m, n]: [u32; 2], found: &mut Vec<[u32; 2]>| self.test_leaves([m, n], other, &test, found);
        let is_leaf = |[m, n]: [u32; 2]| self.tree.is_leaf(m) && other.tree.is_leaf(n);
        if self.tree.nodes.is_empty() || other.tree.nodes.is_empty() {
            return Vec::new();
        }
        search([0, 0], is_leaf, divide, leaf)
    }

    /// All pairs of own triangles, the lower one first, whose boxes overlap and that pass `test`, ascending.
    pub fn pairs_within(&self, test: impl Fn(u32, u32) -> bool + Sync) -> Vec<[u32; 2]> {
        let tree = &self.tree;
        let overlap = |&[m, n]: &[u32; 2]| m == n || overlap(&tree.nodes[m as usize], &tree.nodes[n as usize]);
        let divide = |[m, n]: [u32; 2], into: &mut Vec<[u32; 2]>| {
            let (a, b) = (&tree.nodes[m as usize], &tree.nodes[n as usize]);
            if m == n {
                let [l, r] = a.children(m);
                into.extend([[l, l], [r, r], [l, r]].into_iter().filter(overlap));
            } else if b.count > 0 || (a.count == 0 && size(a) >= size(b)) {
                into.extend(a.children(m).map(|m| [m, n]).into_iter().filter(overlap));
            } else {
                into.extend(b.children(n).map(|n| [m, n]).into_iter().filter(overlap));
            }
        };
        let ordered = |t: u32, u: u32| test(t.min(u), t.max(u));
        let leaf = |[m, n]: [u32; 2], found: &mut Vec<[u32; 2]>| {
            let before = found.len();
            self.test_leaves([m, n], self, &ordered, found);
            found[before..].iter_mut().for_each(|pair| pair.sort_unstable());
        };
        if tree.nodes.is_empty() {
            return Vec::new();
        }
        search([0, 0], |[m, n]| tree.is_leaf(m) && tree.is_leaf(n), divide, leaf)
    }

    /// Tests all triangles of two leaves, or those of one leaf once.
    fn test_leaves(&self, [m, n]: [u32; 2], other: &Self, test: &impl Fn(u32, u32) -> bool, found: &mut Vec<[u32; 2]>) {
        let same = std::ptr::eq(self, other) && m == n;
        let (a, b) = (&self.tree.nodes[m as usize], &other.tree.nodes[n as usize]);
        for i in a.items() {
            let (lo, hi) = bounds(&self.corners[i]);
            if !boxes_overlap(&lo, &hi, &b.lo, &b.hi) {
                continue;
            }
            for j in b.items().filter(|&j| !same || j > i) {
                let (l, h) = bounds(&other.corners[j]);
                let pair = [self.tree.order[i], other.tree.order[j]];
                if boxes_overlap(&lo, &hi, &l, &h) && test(pair[0], pair[1]) {
                    found.push(pair);
                }
            }
        }
    }
}

impl Tree {
    fn is_leaf(&self, n: u32) -> bool {
        self.nodes[n as usize].count > 0
    }
}

/// Divides pairs of boxes until both are leaves, many side by side; what was found, ascending.
fn search(
    root: [u32; 2],
    is_leaf: impl Fn([u32; 2]) -> bool + Sync,
    divide: impl Fn([u32; 2], &mut Vec<[u32; 2]>) + Sync,
    leaf: impl Fn([u32; 2], &mut Vec<[u32; 2]>) + Sync,
) -> Vec<[u32; 2]> {
    let mut tasks = vec![root];
    while tasks.len() < TASKS && tasks.iter().any(|&pair| !is_leaf(pair)) {
        let mut next = Vec::with_capacity(4 * tasks.len());
        for pair in tasks {
            if is_leaf(pair) { next.push(pair) } else { divide(pair, &mut next) }
        }
        tasks = next;
    }
    let below = |start: [u32; 2]| {
        let (mut stack, mut found) = (vec![start], Vec::new());
        while let Some(pair) = stack.pop() {
            if is_leaf(pair) { leaf(pair, &mut found) } else { divide(pair, &mut stack) }
        }
        found
    };
    let mut found = tasks.into_par_iter().map(below).collect::<Vec<_>>().concat();
    found.sort_unstable();
    found
}

#[inline(always)]
fn bounds([a, b, c]: &[Point3<f32>; 3]) -> (Point3<f32>, Point3<f32>) {
    (a.inf(b).inf(c), a.sup(b).sup(c))
}

#[inline(always)]
fn overlap(a: &Node, b: &Node) -> bool {
    boxes_overlap(&a.lo, &a.hi, &b.lo, &b.hi)
}

#[inline(always)]
fn boxes_overlap(lo: &Point3<f32>, hi: &Point3<f32>, l: &Point3<f32>, h: &Point3<f32>) -> bool {
    (0..3).all(|k| lo[k] <= h[k] && l[k] <= hi[k])
}

/// Length of the longest side of a box, metres.
fn size(node: &Node) -> f32 {
    (node.hi - node.lo).max()
}
