//! The one traversal that all queries share: depth first, the more promising child first.

use std::ops::Range;

use super::tree::{Node, Tree};

/// A query over a tree: which boxes it looks into, in which order, and what it does with the items.
pub(crate) trait Query {
    /// How promising a box is: of two children the one with the lower rank is visited first, the left one of equals.
    fn rank(&self, node: &Node) -> f32;

    /// False where no item in a box of this rank can matter any more. Asked right before the box would be visited.
    fn wants(&self, rank: f32) -> bool;

    /// True where the query takes the box `index` as a whole instead of looking into it.
    #[inline(always)]
    fn takes_whole(&mut self, _index: usize) -> bool {
        false
    }

    /// Looks at the items of a leaf, given by their places in the order.
    fn visit(&mut self, places: Range<usize>);
}

impl Tree {
    /// Visits the leaves that `query` wants.
    // Inlined with the query's methods, so that what a query keeps stays in registers.
    #[inline(always)]
    pub(crate) fn traverse<Q: Query>(&self, query: &mut Q) {
        let Some(root) = self.nodes.first() else { return };
        let (mut stack, mut at) = (Stack::new(), (query.rank(root), 0));
        loop {
            let (rank, n) = at;
            if query.wants(rank) && !query.takes_whole(n as usize) {
                let node = &self.nodes[n as usize];
                if node.count == 0 {
                    let [left, right] = node.children(n);
                    let l = (query.rank(&self.nodes[left as usize]), left);
                    let r = (query.rank(&self.nodes[right as usize]), right);
                    let (near, far) = if l.0 <= r.0 { (l, r) } else { (r, l) };
                    stack.push(far);
                    at = near;
                    continue;
                }
                query.visit(node.items());
            }
            match stack.pop() {
                Some(next) => at = next,
                None => return,
            }
        }
    }
}

/// A small stack without allocation.
struct Stack {
    items: [(f32, u32); 64],
    len: usize,
}

impl Stack {
    fn new() -> Self {
        Self { items: [(0.0, 0); 64], len: 0 }
    }
    // Median splits balance the tree, so that 64 entries are enough for more items than a u32 counts.
    #[inline(always)]
    fn push(&mut self, item: (f32, u32)) {
        self.items[self.len] = item;
        self.len += 1;
    }
    #[inline(always)]
    fn pop(&mut self) -> Option<(f32, u32)> {
        self.len = self.len.checked_sub(1)?;
        Some(self.items[self.len])
    }
}
