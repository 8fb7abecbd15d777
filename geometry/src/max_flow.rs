//! Minimum cut of a graph with two terminals (Boykov and Kolmogorov 2004): two search trees grown from source and
//! sink, augmented where they meet, repaired by adoption.

/// Marks a node without parent.
const NONE: u32 = u32::MAX;
/// Parent is the node's own terminal.
const TERMINAL: u32 = u32::MAX - 1;
/// The parent was cut off; a new one is being searched for.
const ORPHAN: u32 = u32::MAX - 2;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Tree {
    Free,
    Source,
    Sink,
}

/// A graph with its capacities, which are integers, so that the cut is exact and always the same.
#[derive(Debug, Clone)]
pub struct GraphCut {
    /// Source capacity minus sink capacity that is left at each node.
    terminal: Vec<i64>,
    first: Vec<u32>,
    next: Vec<u32>,
    head: Vec<u32>,
    residual: Vec<i64>,
    tree: Vec<Tree>,
    parent: Vec<u32>,
    stamp: Vec<u32>,
    depth: Vec<u32>,
    active: std::collections::VecDeque<u32>,
    queued: Vec<bool>,
    orphans: std::collections::VecDeque<u32>,
    time: u32,
    flow: i64,
}

impl GraphCut {
    /// A graph of `nodes` nodes without edges; `edges` is a hint of their number.
    pub fn new(nodes: usize, edges: usize) -> Self {
        Self {
            terminal: vec![0; nodes],
            first: vec![NONE; nodes],
            next: Vec::with_capacity(2 * edges),
            head: Vec::with_capacity(2 * edges),
            residual: Vec::with_capacity(2 * edges),
            tree: vec![Tree::Free; nodes],
            parent: vec![NONE; nodes],
            stamp: vec![0; nodes],
            depth: vec![0; nodes],
            active: std::collections::VecDeque::new(),
            queued: vec![false; nodes],
            orphans: std::collections::VecDeque::new(),
            time: 0,
            flow: 0,
        }
    }

    /// Adds the cost of cutting `node` from the source (it ends on the sink's side) and from the sink.
    pub fn add_terminal(&mut self, node: u32, source: i64, sink: i64) {
        let node = node as usize;
        let mut source = source.max(0);
        let mut sink = sink.max(0);
        if self.terminal[node] > 0 {
            source += self.terminal[node];
        } else {
            sink -= self.terminal[node];
        }
        self.flow += source.min(sink);
        self.terminal[node] = source - sink;
    }

    /// Adds an edge that costs `forward` when `a` is on the source's side and `b` on the sink's, `backward` the other
    /// way round.
    pub fn add_edge(&mut self, a: u32, b: u32, forward: i64, backward: i64) {
        for (from, to, capacity) in [(a, b, forward), (b, a, backward)] {
            self.next.push(self.first[from as usize]);
            self.first[from as usize] = (self.head.len()) as u32;
            self.head.push(to);
            self.residual.push(capacity.max(0));
        }
    }

    /// Finds the maximum flow, which is the cost of the minimum cut. Call once.
    pub fn solve(&mut self) -> i64 {
        for node in 0..self.terminal.len() {
            if self.terminal[node] != 0 {
                self.tree[node] = if self.terminal[node] > 0 { Tree::Source } else { Tree::Sink };
                self.parent[node] = TERMINAL;
                self.depth[node] = 1;
                self.activate(node as u32);
            }
        }
        while let Some(&node) = self.active.front() {
            if self.tree[node as usize] == Tree::Free {
                self.retire();
                continue;
            }
            match self.grow(node) {
                Some(edge) => {
                    self.time += 1;
                    self.augment(edge);
                    self.adopt_all();
                }
                None => self.retire(),
            }
        }
        self.flow
    }

    /// After [`solve`](Self::solve): true where `node` is on the source's side of the cut.
    pub fn is_source(&self, node: u32) -> bool {
        self.tree[node as usize] == Tree::Source
    }

    fn activate(&mut self, node: u32) {
        if !self.queued[node as usize] {
            self.queued[node as usize] = true;
            self.active.push_back(node);
        }
    }

    fn retire(&mut self) {
        if let Some(node) = self.active.pop_front() {
            self.queued[node as usize] = false;
        }
    }

    /// Capacity left from parent's side to child's along edge `e` that leaves `tree`.
    fn outward(&self, tree: Tree, e: u32) -> i64 {
        if tree == Tree::Source { self.residual[e as usize] } else { self.residual[(e ^ 1) as usize] }
    }

    /// Grows the tree of `node`; the edge (source side to sink side) where it meets the other tree, if it does.
    fn grow(&mut self, node: u32) -> Option<u32> {
        let tree = self.tree[node as usize];
        let mut e = self.first[node as usize];
        while e != NONE {
            let other = self.head[e as usize] as usize;
            if self.outward(tree, e) > 0 {
                if self.tree[other] == Tree::Free {
                    self.tree[other] = tree;
                    self.parent[other] = e ^ 1;
                    self.stamp[other] = self.stamp[node as usize];
                    self.depth[other] = self.depth[node as usize] + 1;
                    self.activate(other as u32);
                } else if self.tree[other] != tree {
                    return Some(if tree == Tree::Source { e } else { e ^ 1 });
                } else if self.stamp[other] <= self.stamp[node as usize]
                    && self.depth[other] > self.depth[node as usize] + 1
                    && self.parent[other] < ORPHAN
                {
                    self.parent[other] = e ^ 1;
                    self.stamp[other] = self.stamp[node as usize];
                    self.depth[other] = self.depth[node as usize] + 1;
                }
            }
            e = self.next[e as usize];
        }
        None
    }

    /// Pushes as much as fits along the path through `edge`.
    fn augment(&mut self, edge: u32) {
        let tail = self.head[(edge ^ 1) as usize];
        let head = self.head[edge as usize];
        let room = self.residual[edge as usize].min(self.room_to_root(tail)).min(self.room_to_root(head));
        self.residual[edge as usize] -= room;
        self.residual[(edge ^ 1) as usize] += room;
        self.push_to_root(tail, room);
        self.push_to_root(head, room);
        self.flow += room;
    }

    fn room_to_root(&self, mut node: u32) -> i64 {
        let tree = self.tree[node as usize];
        let mut room = i64::MAX;
        loop {
            let e = self.parent[node as usize];
            if e == TERMINAL {
                return room.min(self.terminal[node as usize].abs());
            }
            room = room.min(self.outward(tree, e ^ 1));
            node = self.head[e as usize];
        }
    }

    fn push_to_root(&mut self, mut node: u32, room: i64) {
        let source = self.tree[node as usize] == Tree::Source;
        loop {
            let e = self.parent[node as usize];
            if e == TERMINAL {
                self.terminal[node as usize] -= if source { room } else { -room };
                if self.terminal[node as usize] == 0 {
                    self.orphan(node);
                }
                return;
            }
            let downward = if source { e ^ 1 } else { e };
            self.residual[downward as usize] -= room;
            self.residual[(downward ^ 1) as usize] += room;
            if self.residual[downward as usize] == 0 {
                self.orphan(node);
            }
            node = self.head[e as usize];
        }
    }

    fn orphan(&mut self, node: u32) {
        self.parent[node as usize] = ORPHAN;
        self.orphans.push_back(node);
    }

    fn adopt_all(&mut self) {
        while let Some(node) = self.orphans.pop_front() {
            self.adopt(node);
        }
    }

    fn adopt(&mut self, node: u32) {
        let tree = self.tree[node as usize];
        let (mut best, mut best_depth) = (NONE, u32::MAX);
        let mut e = self.first[node as usize];
        while e != NONE {
            let other = self.head[e as usize];
            if self.tree[other as usize] == tree && self.outward(tree, e ^ 1) > 0 {
                let depth = self.depth_to_root(other);
                if depth < best_depth {
                    (best, best_depth) = (e, depth);
                }
            }
            e = self.next[e as usize];
        }
        if best == NONE {
            self.free(node, tree);
        } else {
            self.parent[node as usize] = best;
            self.stamp[node as usize] = self.time;
            self.depth[node as usize] = best_depth + 1;
        }
    }

    /// Depth of `node` below its terminal, `u32::MAX` where its path ends in an orphan; marks the path.
    fn depth_to_root(&mut self, node: u32) -> u32 {
        let (mut at, mut steps) = (node, 0);
        let base = loop {
            let i = at as usize;
            if self.stamp[i] == self.time && self.parent[i] < ORPHAN {
                break self.depth[i];
            }
            match self.parent[i] {
                TERMINAL => {
                    (self.stamp[i], self.depth[i]) = (self.time, 1);
                    break 1;
                }
                NONE | ORPHAN => return u32::MAX,
                e => at = self.head[e as usize],
            }
            steps += 1;
        };
        let depth = base + steps;
        let (mut walk, mut d) = (node, depth);
        while walk != at {
            (self.stamp[walk as usize], self.depth[walk as usize]) = (self.time, d);
            d -= 1;
            walk = self.head[self.parent[walk as usize] as usize];
        }
        depth
    }

    fn free(&mut self, node: u32, tree: Tree) {
        let mut e = self.first[node as usize];
        while e != NONE {
            let other = self.head[e as usize];
            if self.tree[other as usize] == tree {
                if self.outward(tree, e ^ 1) > 0 {
                    self.activate(other);
                }
                if self.parent[other as usize] == (e ^ 1) {
                    self.orphan(other);
                }
            }
            e = self.next[e as usize];
        }
        self.tree[node as usize] = Tree::Free;
        self.parent[node as usize] = NONE;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn brute_force(terminals: &[(i64, i64)], edges: &[(u32, u32, i64, i64)]) -> i64 {
        let cost = |mask: u32| {
            let source = |n: u32| mask >> n & 1 == 1;
            let ends: i64 = terminals.iter().enumerate().map(|(i, t)| if source(i as u32) { t.1 } else { t.0 }).sum();
            let cut: i64 = edges
                .iter()
                .map(|&(a, b, f, r)| match (source(a), source(b)) {
                    (true, false) => f,
                    (false, true) => r,
                    _ => 0,
                })
                .sum();
            ends + cut
        };
        (0..1u32 << terminals.len()).map(cost).min().unwrap()
    }

    proptest! {
        #[test]
        fn the_cut_is_the_minimum(
            terminals in prop::collection::vec((0i64..20, 0i64..20), 2..10),
            raw in prop::collection::vec((0u32..10, 0u32..10, 0i64..15, 0i64..15), 0..30),
        ) {
            let n = terminals.len() as u32;
            let edges: Vec<_> =
                raw.into_iter().map(|(a, b, f, r)| (a % n, b % n, f, r)).filter(|e| e.0 != e.1).collect();
            let mut graph = GraphCut::new(n as usize, edges.len());
            for (i, t) in terminals.iter().enumerate() {
                graph.add_terminal(i as u32, t.0, t.1);
            }
            for &(a, b, f, r) in &edges {
                graph.add_edge(a, b, f, r);
            }
            let flow = graph.solve();
            prop_assert_eq!(flow, brute_force(&terminals, &edges));
            let side = |v: u32| graph.is_source(v);
            let ends: i64 = terminals.iter().enumerate().map(|(i, t)| if side(i as u32) { t.1 } else { t.0 }).sum();
            let cut: i64 = edges.iter().map(|&(a, b, f, r)| match (side(a), side(b)) {
                (true, false) => f,
                (false, true) => r,
                _ => 0,
            }).sum();
            prop_assert_eq!(flow, ends + cut);
        }
    }
}
