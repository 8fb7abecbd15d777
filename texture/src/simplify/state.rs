//! A surface while its edges are collapsed.

use std::collections::HashMap;

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::{cost::Quadric, seamed::Seamed};

/// Weight of the planes that hold borders of the surface and of charts in place.
const BORDER: f64 = 4.0;
/// Weight of the squared length of the collapsed edge: keeps flat parts evenly meshed.
const SHAPE: f64 = 1e-3;
/// A triangle may not turn by more than this (cosine) in one collapse.
const TURN: f64 = 0.3;
/// Least height of a triangle over its longest side, as a share of that: no needles.
const NEEDLE: f64 = 0.02;
/// A triangle in the picture may shrink to this share of what its size on the surface asks for, in one collapse.
const SHRINK: f32 = 0.1;
/// Share of the edges that a round takes.
const SHARE: usize = 3;

/// A surface while its edges are collapsed. Vertices are the surface's; wedges are the texture's vertices, one or more a vertex.
#[derive(Clone)]
pub(super) struct State<'a> {
    surface: &'a Seamed<'a>,
    positions: Vec<Point3<f64>>,
    /// Corners as wedges; dead ones are marked in `is_alive`.
    triangles: Vec<[u32; 3]>,
    is_alive: Vec<bool>,
    pub alive: usize,
    /// Triangles at each vertex, dead ones among them.
    around: Vec<Vec<u32>>,
    quadrics: Vec<Quadric>,
    /// The wedges that sides of outlines of charts have passed over, by the wedges at their ends.
    passed: HashMap<[u32; 2], Vec<u32>>,
    /// How far an outline may lie from where it was.
    pub room: f32,
    is_touched: Vec<bool>,
}

/// A collapse of the vertex `from` onto its neighbour `onto`.
#[derive(Debug, Clone, Copy)]
struct Collapse {
    from: u32,
    onto: u32,
}

/// A side of an outline, and the wedges that it has passed over.
type Passed = ([u32; 2], Vec<u32>);

impl<'a> State<'a> {
    pub fn new(surface: &'a Seamed<'a>) -> Self {
        let count = surface.positions.len();
        let mut state = Self {
            surface,
            positions: surface.positions.iter().map(|p| p.cast()).collect(),
            triangles: surface.triangles.to_vec(),
            is_alive: vec![true; surface.triangles.len()],
            alive: surface.triangles.len(),
            around: vec![Vec::new(); count],
            quadrics: vec![Quadric::default(); count],
            passed: HashMap::new(),
            room: surface.room,
            is_touched: vec![false; count],
        };
        for t in 0..state.triangles.len() {
            for v in state.corners(t as u32) {
                state.around[v as usize].push(t as u32);
            }
        }
        (0..state.triangles.len()).for_each(|t| state.add_planes(t as u32));
        state
    }

    /// The triangles that are left.
    pub fn triangles(&self) -> Vec<[u32; 3]> {
        self.triangles.iter().zip(&self.is_alive).filter(|(_, alive)| **alive).map(|(t, _)| *t).collect()
    }

    /// One round of collapses, cheapest first; returns the number of triangles that went.
    pub fn round(&mut self, target: usize) -> usize {
        let before = self.alive;
        let mut costs = self.costs();
        let wanted = (costs.len() / SHARE).max(64).min(costs.len());
        if wanted < costs.len() {
            costs.select_nth_unstable_by(wanted, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        }
        let (cheap, dear) = costs.split_at_mut(wanted);
        self.is_touched.fill(false);
        self.collapse_all(cheap, target);
        // Where nothing cheap could go, something dear may.
        if self.alive == before {
            self.collapse_all(dear, target);
        }
        before - self.alive
    }

    fn collapse_all(&mut self, costs: &mut [(f64, [u32; 2])], target: usize) {
        costs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for (_, [from, onto]) in costs {
            if self.alive <= target {
                return;
            }
            if !self.is_touched[*from as usize] && !self.is_touched[*onto as usize] {
                self.collapse(Collapse { from: *from, onto: *onto });
            }
        }
    }

    /// The cost of each edge in its cheaper direction.
    fn costs(&self) -> Vec<(f64, [u32; 2])> {
        let alive: Vec<u32> = (0..self.triangles.len() as u32).filter(|&t| self.is_alive[t as usize]).collect();
        let of_triangle = |&t: &u32| {
            let c = self.corners(t);
            let side = |k: usize| {
                let [u, v] = [c[k], c[(k + 1) % 3]];
                // Both triangles of an edge name it in opposite directions.
                [(self.cost(u, v), [u, v]), (self.cost(v, u), [v, u])]
            };
            let is_first = |k: usize| c[k] < c[(k + 1) % 3] || self.is_border(c[k], c[(k + 1) % 3]);
            (0..3).filter(|k| is_first(*k)).flat_map(side).collect::<Vec<_>>()
        };
        alive.par_iter().flat_map_iter(of_triangle).collect()
    }

    fn cost(&self, from: u32, onto: u32) -> f64 {
        let (p, q) = (self.positions[from as usize], self.positions[onto as usize]);
        let length = (p - q).norm_squared();
        self.quadrics[from as usize].at(&q) + SHAPE * length * length
    }

    #[inline]
    fn corners(&self, t: u32) -> [u32; 3] {
        self.triangles[t as usize].map(|w| self.surface.source[w as usize])
    }

    fn at(&self, v: u32) -> impl Iterator<Item = u32> + '_ {
        self.around[v as usize].iter().copied().filter(|&t| self.is_alive[t as usize])
    }

    /// Triangles at both vertices.
    fn shared(&self, u: u32, v: u32) -> Vec<u32> {
        self.at(u).filter(|&t| self.corners(t).contains(&v)).collect()
    }

    fn is_border(&self, u: u32, v: u32) -> bool {
        self.at(u).filter(|&t| self.corners(t).contains(&v)).count() == 1
    }

    /// Neighbours of a vertex, sorted.
    fn neighbours(&self, v: u32) -> Vec<u32> {
        let mut all: Vec<u32> = self.at(v).flat_map(|t| self.corners(t)).filter(|n| *n != v).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Whether the side from `a` to `b` (wedges) is on the outline of its chart: no triangle names it in the other direction.
    fn is_outline(&self, a: u32, b: u32) -> bool {
        let v = self.surface.source[b as usize];
        !self.at(v).any(|t| {
            let w = self.triangles[t as usize];
            (0..3).any(|k| w[k] == b && w[(k + 1) % 3] == a)
        })
    }

    /// Planes of a triangle, and across those of its sides that are outlines.
    fn add_planes(&mut self, t: u32) {
        let (wedges, tri) = (self.triangles[t as usize], self.corners(t));
        let [a, b, c] = tri.map(|v| self.positions[v as usize]);
        let cross = (b - a).cross(&(c - a));
        let Some(n) = cross.try_normalize(1e-30) else { return };
        for v in tri {
            self.quadrics[v as usize].add(&n, &a, cross.norm() / 6.0);
        }
        for k in 0..3 {
            let next = (k + 1) % 3;
            if !self.is_outline(wedges[k], wedges[next]) {
                continue;
            }
            let (p, q) = (self.positions[tri[k] as usize], self.positions[tri[next] as usize]);
            let Some(m) = (q - p).cross(&n).try_normalize(1e-30) else { continue };
            let weight = BORDER * (q - p).norm_squared();
            self.quadrics[tri[k] as usize].add(&m, &p, weight);
            self.quadrics[tri[next] as usize].add(&m, &p, weight);
        }
    }

    /// Collapses where that is allowed.
    fn collapse(&mut self, c: Collapse) {
        let shared = self.shared(c.from, c.onto);
        if shared.is_empty() || !self.keeps_topology(c, shared.len()) {
            return;
        }
        let Some(moves) = self.wedge_moves(c, &shared) else { return };
        let rest: Vec<u32> = self.at(c.from).filter(|t| !shared.contains(t)).collect();
        if !rest.iter().all(|&t| self.keeps_side(t, c, &moves)) {
            return;
        }
        let Some(outlines) = self.outlines(c, &moves) else { return };
        self.passed.extend(outlines);
        for t in &shared {
            self.is_alive[*t as usize] = false;
        }
        self.alive -= shared.len();
        for &t in &rest {
            let moved = self.triangles[t as usize].map(|w| onto(&moves, w));
            self.triangles[t as usize] = moved;
            self.around[c.onto as usize].push(t);
        }
        let quadric = self.quadrics[c.from as usize];
        self.quadrics[c.onto as usize].take(&quadric);
        let touched = self.neighbours(c.onto);
        touched.iter().chain([&c.from, &c.onto]).for_each(|&v| self.is_touched[v as usize] = true);
    }

    /// The link condition: the ends share exactly the vertices opposite the edge, and no border is pinched or left.
    fn keeps_topology(&self, c: Collapse, shared: usize) -> bool {
        let (near, far) = (self.neighbours(c.from), self.neighbours(c.onto));
        let common = near.iter().filter(|n| far.binary_search(n).is_ok()).count();
        if common != shared || shared > 2 || near.len() + far.len() < shared + 5 {
            return false;
        }
        let is_on_border = near.iter().any(|&n| self.is_border(c.from, n));
        !is_on_border || shared == 1
    }

    /// Where each wedge of the vertex goes: to the wedge of the other end in the same chart. `None` where one has no such: the edge leaves the border of
    /// charts, or three of them meet.
    fn wedge_moves(&self, c: Collapse, shared: &[u32]) -> Option<Vec<[u32; 2]>> {
        let wedge =
            |t: u32, v: u32| self.triangles[t as usize].into_iter().find(|&w| self.surface.source[w as usize] == v);
        let mut moves: Vec<[u32; 2]> = Vec::with_capacity(2);
        for &t in shared {
            let step = [wedge(t, c.from)?, wedge(t, c.onto)?];
            match moves.iter().find(|m| m[0] == step[0]) {
                Some(known) if known[1] != step[1] => return None,
                Some(_) => {}
                None => moves.push(step),
            }
        }
        let all_go = self.at(c.from).all(|t| wedge(t, c.from).is_some_and(|w| moves.iter().any(|m| m[0] == w)));
        all_go.then_some(moves)
    }

    /// Whether a triangle keeps its side, on the surface and in the picture, and becomes no needle.
    fn keeps_side(&self, t: u32, c: Collapse, moves: &[[u32; 2]]) -> bool {
        let tri = self.corners(t);
        let old = tri.map(|v| self.positions[v as usize]);
        let new = tri.map(|v| self.positions[if v == c.from { c.onto } else { v } as usize]);
        let normal = |[a, b, c]: [Point3<f64>; 3]| -> Vector3<f64> { (b - a).cross(&(c - a)) };
        let (n0, n1) = (normal(old), normal(new));
        let longest = (0..3).map(|k| (new[k] - new[(k + 1) % 3]).norm_squared()).fold(0.0, f64::max);
        let size = n1.norm();
        if size <= NEEDLE * longest || n0.dot(&n1) < TURN * n0.norm() * size {
            return false;
        }
        if self.surface.uv.is_empty() {
            return true;
        }
        let flat = |wedges: [u32; 3]| {
            let [a, b, c] = wedges.map(|w| self.surface.uv[w as usize]);
            (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
        };
        let wedges = self.triangles[t as usize];
        let (before, after) = (flat(wedges), flat(wedges.map(|w| onto(moves, w))));
        let expected = before * (size / n0.norm().max(1e-30)) as f32;
        before == 0.0 || after * before.signum() > SHRINK * expected.abs()
    }

    /// The new sides of outlines and the wedges that they pass over; `None` where one of these is farther away than there is room for.
    fn outlines(&self, c: Collapse, moves: &[[u32; 2]]) -> Option<Vec<Passed>> {
        let mut found = Vec::new();
        if self.surface.uv.is_empty() {
            return Some(found);
        }
        for &[from, onto] in moves {
            for t in self.at(c.from) {
                let w = self.triangles[t as usize];
                let Some(k) = w.iter().position(|&x| x == from) else { continue };
                for (other, side) in
                    [(w[(k + 1) % 3], [from, w[(k + 1) % 3]]), (w[(k + 2) % 3], [w[(k + 2) % 3], from])]
                {
                    if other == onto || !self.is_outline(side[0], side[1]) {
                        continue;
                    }
                    let known = |a: u32, b: u32| self.passed.get(&sorted(a, b)).into_iter().flatten().copied();
                    let passed: Vec<u32> = known(from, other).chain(known(from, onto)).chain([from]).collect();
                    if passed.iter().any(|&w| self.off(w, other, onto) > self.room) {
                        return None;
                    }
                    found.push((sorted(other, onto), passed));
                }
            }
        }
        Some(found)
    }

    /// Distance of a wedge from the straight line between two others, in the picture.
    fn off(&self, wedge: u32, a: u32, b: u32) -> f32 {
        let [p, a, b] = [wedge, a, b].map(|w| nalgebra::Vector2::from(self.surface.uv[w as usize]));
        let along = b - a;
        let share = ((p - a).dot(&along) / along.norm_squared().max(1e-20)).clamp(0.0, 1.0);
        (p - a - along * share).norm()
    }
}

/// The wedge that a wedge becomes.
fn onto(moves: &[[u32; 2]], wedge: u32) -> u32 {
    moves.iter().find(|m| m[0] == wedge).map_or(wedge, |m| m[1])
}

fn sorted(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}
