//! The shortest loop of a surface that bounds nothing: homology by a tree and a cotree (Eppstein 2003, "Dynamic
//! generators of topologically embedded graphs"), loops by shortest paths from a base point (Erickson and Whittlesey
//! 2005, "Greedy optimal homotopy and homology generators").

use std::{cmp::Reverse, collections::BinaryHeap};

use crate::{
    Mesh,
    topology::{Edges, boundary_loops},
};

const NONE: u32 = u32::MAX;

/// The shortest simple cycle of inner vertices, at most `longest` metres long, that does not bound a part of the
/// surface (borders count as closed). `None` where there is none.
pub fn shortest_cycle(mesh: &Mesh, longest: f32) -> Option<Vec<u32>> {
    let edges = Edges::new(&mesh.triangles);
    if edges.uses.iter().any(|&u| u > 2) {
        return None;
    }
    let crossed = crossed_generators(mesh, &edges);
    if crossed.iter().all(|&c| c == 0) {
        return None;
    }
    let graph = Graph::new(mesh, &edges, crossed);
    let mut search = Search::new(mesh.positions.len(), longest);
    // Every such loop crosses one of the marked edges.
    let mut bases: Vec<u32> =
        (0..edges.vertices.len()).filter(|&e| graph.crossed[e] != 0).flat_map(|e| edges.vertices[e]).collect();
    bases.sort_unstable();
    bases.dedup();
    bases.iter().filter(|&&v| !graph.on_border[v as usize]).for_each(|&v| search.from(&graph, v));
    search.found
}

/// For each edge, which of the dual loops that generate the homology cross it: one bit each, at most 64.
fn crossed_generators(mesh: &Mesh, edges: &Edges) -> Vec<u64> {
    let sides = dual_sides(mesh, edges);
    let faces = sides.iter().flatten().max().map_or(0, |&f| f as usize + 1);
    let in_tree = spanning(mesh.positions.len(), &edges.vertices, |_| true).1;
    let (parents, in_cotree) = spanning(faces, &sides, |e| !in_tree[e]);
    let mut crossed = vec![0u64; edges.vertices.len()];
    let generators = (0..crossed.len()).filter(|&e| !in_tree[e] && !in_cotree[e]);
    for (bit, e) in generators.take(64).enumerate() {
        crossed[e] ^= 1 << bit;
        for mut face in sides[e] {
            while let Some((up, edge)) = parents[face as usize] {
                crossed[edge as usize] ^= 1 << bit;
                face = up;
            }
        }
    }
    crossed
}

/// The faces at each edge: triangles, and behind them one for each border.
fn dual_sides(mesh: &Mesh, edges: &Edges) -> Vec<[u32; 2]> {
    let mut sides = edges.triangles();
    for (k, border) in boundary_loops(&mesh.triangles).iter().enumerate() {
        let face = (mesh.triangles.len() + k) as u32;
        for i in 0..border.len() {
            let (a, b) = (border[i], border[(i + 1) % border.len()]);
            if let Ok(e) = edges.vertices.binary_search(&[a.min(b), a.max(b)]) {
                sides[e][1] = face;
            }
        }
    }
    // An edge that a broken border leaves without a face closes on itself.
    sides.iter_mut().filter(|s| s[1] == NONE).for_each(|s| s[1] = s[0]);
    sides
}

/// A forest of a graph, breadth first from the lowest node of each part, over the edges that `may` be used: each node's
/// parent with the edge to it, and which edges are in it.
fn spanning(nodes: usize, ends: &[[u32; 2]], may: impl Fn(usize) -> bool) -> (Vec<Option<(u32, u32)>>, Vec<bool>) {
    let around = rows(nodes, ends);
    let (mut parents, mut seen, mut used) = (vec![None; nodes], vec![false; nodes], vec![false; ends.len()]);
    for root in 0..nodes {
        if std::mem::replace(&mut seen[root], true) {
            continue;
        }
        let mut queue = std::collections::VecDeque::from([root as u32]);
        while let Some(at) = queue.pop_front() {
            for &(to, edge) in &around[at as usize] {
                if may(edge as usize) && !std::mem::replace(&mut seen[to as usize], true) {
                    (parents[to as usize], used[edge as usize]) = (Some((at, edge)), true);
                    queue.push_back(to);
                }
            }
        }
    }
    (parents, used)
}

/// The neighbours of each node, with the edges to them.
fn rows(nodes: usize, ends: &[[u32; 2]]) -> Vec<Vec<(u32, u32)>> {
    let mut rows = vec![Vec::new(); nodes];
    for (e, &[a, b]) in ends.iter().enumerate() {
        rows[a as usize].push((b, e as u32));
        rows[b as usize].push((a, e as u32));
    }
    rows
}

struct Graph {
    around: Vec<Vec<(u32, u32)>>,
    lengths: Vec<f32>,
    crossed: Vec<u64>,
    on_border: Vec<bool>,
}

impl Graph {
    fn new(mesh: &Mesh, edges: &Edges, crossed: Vec<u64>) -> Self {
        let length = |e: &[u32; 2]| (mesh.positions[e[0] as usize] - mesh.positions[e[1] as usize]).norm();
        let mut on_border = vec![false; mesh.positions.len()];
        let borders = edges.vertices.iter().zip(&edges.uses).filter(|(_, uses)| **uses == 1);
        borders.flat_map(|(e, _)| e).for_each(|&v| on_border[v as usize] = true);
        let lengths = edges.vertices.iter().map(length).collect();
        Self { around: rows(mesh.positions.len(), &edges.vertices), lengths, crossed, on_border }
    }
}

/// The shortest paths from one base point after the other; what they reach is forgotten between them.
struct Search {
    /// Distance from the base, the way back, and which generators the path crosses.
    reached: Vec<(f32, u32, u64)>,
    touched: Vec<u32>,
    limit: f32,
    found: Option<Vec<u32>>,
}

const FAR: (f32, u32, u64) = (f32::INFINITY, NONE, 0);

impl Search {
    fn new(count: usize, longest: f32) -> Self {
        Self { reached: vec![FAR; count], touched: Vec::new(), limit: longest, found: None }
    }

    fn from(&mut self, graph: &Graph, base: u32) {
        let mut heap = BinaryHeap::from([Reverse((0u32, base))]);
        self.touch(base, (0.0, NONE, 0));
        while let Some(Reverse((bits, v))) = heap.pop() {
            let (distance, _, crossed) = self.reached[v as usize];
            // Distances are not negative: their bits are in their order.
            if f32::from_bits(bits) > distance || 2.0 * distance > self.limit {
                continue;
            }
            for &(to, edge) in graph.around[v as usize].iter().filter(|n| !graph.on_border[n.0 as usize]) {
                let next = distance + graph.lengths[edge as usize];
                let by_this = crossed ^ graph.crossed[edge as usize];
                let (there, _, by_other) = self.reached[to as usize];
                if there.is_finite() && by_this != by_other {
                    self.close(v, to, there + next);
                }
                if next < there {
                    self.touch(to, (next, v, by_this));
                    heap.push(Reverse((next.to_bits(), to)));
                }
            }
        }
        self.touched.drain(..).for_each(|v| self.reached[v as usize] = FAR);
    }

    fn touch(&mut self, v: u32, reached: (f32, u32, u64)) {
        self.reached[v as usize] = reached;
        self.touched.push(v);
    }

    /// The two ways from the base, where they are the shortest loop so far: without the part that they share.
    fn close(&mut self, v: u32, to: u32, length: f32) {
        if length >= self.limit {
            return;
        }
        let way = |mut at: u32| {
            let mut way = vec![at];
            while self.reached[at as usize].1 != NONE {
                at = self.reached[at as usize].1;
                way.push(at);
            }
            way
        };
        let (mut one, mut other) = (way(v), way(to));
        while one.len() > 1 && other.len() > 1 && one[one.len() - 2] == other[other.len() - 2] {
            one.pop();
            other.pop();
        }
        other.pop();
        one.reverse();
        one.extend(other);
        if one.len() > 2 {
            self.limit = length;
            self.found = Some(one);
        }
    }
}
