//! Building: median splits on the longest axis of the centroids.

use nalgebra::Point3;

use super::tree::{Node, Tree};

/// More items than this are divided by two threads.
const PARALLEL: usize = 4096;

/// A tree over items with these `centroids`, at most `leaf` items in a leaf, still without boxes. The same for any number
/// of threads. O(n log n).
pub(crate) fn divide(centroids: &[Point3<f32>], leaf: usize) -> Tree {
    let mut order: Vec<u32> = (0..centroids.len() as u32).collect();
    let mut nodes = Vec::new();
    if !centroids.is_empty() {
        nodes.resize(node_counts(centroids.len(), leaf).0, Node::EMPTY);
        Division { centroids, leaf }.divide(&mut nodes, &mut order, (0, 0));
    }
    Tree { nodes, order }
}

/// Number of nodes over `count` and over `count + 1` items.
fn node_counts(count: usize, leaf: usize) -> (usize, usize) {
    if count < leaf {
        return (1, 1);
    }
    let (half, more) = node_counts(count / 2, leaf);
    let (here, next) = if count.is_multiple_of(2) { (2 * half, half + more) } else { (half + more, 2 * more) };
    (if count == leaf { 1 } else { 1 + here }, 1 + next)
}

struct Division<'a> {
    centroids: &'a [Point3<f32>],
    leaf: usize,
}

impl Division<'_> {
    /// Divides the items `order` among `nodes` (all those over them); `at` is the index of the first node and of the first
    /// place of the order.
    fn divide(&self, nodes: &mut [Node], order: &mut [u32], at: (usize, usize)) {
        let count = order.len();
        let (node, below) = nodes.split_at_mut(1);
        if count <= self.leaf {
            (node[0].start, node[0].count) = (at.1 as u32, count as u32);
            return;
        }
        let middle = count / 2;
        self.split(order, middle);
        let (left, right) = order.split_at_mut(middle);
        let (left_nodes, right_nodes) = below.split_at_mut(node_counts(middle, self.leaf).0);
        let right_at = (at.0 + 1 + left_nodes.len(), at.1 + middle);
        node[0].start = right_at.0 as u32;
        let mut low = || self.divide(left_nodes, left, (at.0 + 1, at.1));
        let mut high = || self.divide(right_nodes, right, right_at);
        if count > PARALLEL {
            rayon::join(low, high);
        } else {
            low();
            high();
        }
    }

    /// Brings the `middle` lowest items along the longest axis to the front; of equal ones the lower index is lower.
    fn split(&self, order: &mut [u32], middle: usize) {
        let c = |t: u32| self.centroids[t as usize];
        let lo = order.iter().fold(c(order[0]), |m, &t| m.inf(&c(t)));
        let hi = order.iter().fold(c(order[0]), |m, &t| m.sup(&c(t)));
        let axis = (hi - lo).imax();
        order.select_nth_unstable_by(middle, |&a, &b| c(a)[axis].total_cmp(&c(b)[axis]).then(a.cmp(&b)));
    }
}
