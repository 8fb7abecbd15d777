//! A patch in a hole: its border comes first and stays; edges are split and flipped until it is evenly meshed.

use std::collections::BTreeSet;

use nalgebra::Point3;

use crate::topology::{Edges, VertexNeighbors};

/// Rounds of splitting and flipping.
const ROUNDS: usize = 12;
/// An inner edge longer than this many border edges is split.
const LONG: f64 = 1.5;
/// Passes of tightening.
const TIGHTENING: usize = 200;
/// Maximum number of vertices of a patch.
const MAX_VERTICES: usize = 20_000;

/// Vertices (border first, in its order) and triangles of a patch.
#[derive(Debug, Clone)]
pub(super) struct Patch {
    pub positions: Vec<Point3<f64>>,
    pub triangles: Vec<[u32; 3]>,
    pub border: usize,
}

impl Patch {
    pub(super) fn new(border: Vec<Point3<f64>>, triangles: Vec<[u32; 3]>) -> Self {
        Self { border: border.len(), positions: border, triangles }
    }

    /// Splits and flips until inner edges are about as long as the border's. `blocked` names border vertex pairs
    /// that are edges of the mesh around.
    pub(super) fn refine(&mut self, blocked: &dyn Fn(usize, usize) -> bool) {
        let target = self.border_edge() * LONG;
        for _ in 0..ROUNDS {
            let split = self.split_long(target);
            let mut flips = 0;
            for _ in 0..8 {
                let n = self.flip_edges(blocked);
                flips += n;
                if n == 0 {
                    break;
                }
            }
            if split > 0 {
                self.even_out(3);
            }
            if split == 0 && flips == 0 || self.positions.len() > MAX_VERTICES {
                break;
            }
        }
    }

    /// Draws the inner vertices to where they balance: a membrane without the ridges of a coarse triangulation.
    pub(super) fn tighten(&mut self) {
        self.even_out(TIGHTENING);
    }

    /// Total area.
    pub(super) fn area(&self) -> f64 {
        let double = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| self.positions[v as usize]);
            (b - a).cross(&(c - a)).norm()
        };
        0.5 * self.triangles.iter().map(double).sum::<f64>()
    }

    fn border_edge(&self) -> f64 {
        let n = self.border;
        (0..n).map(|i| (self.positions[i] - self.positions[(i + 1) % n]).norm()).sum::<f64>() / n.max(1) as f64
    }

    /// Inner edges with their two triangles, ascending.
    fn inner_edges(edges: &Edges) -> impl Iterator<Item = ((u32, u32), [usize; 2])> {
        let sides = edges.triangles();
        let inner = (0..sides.len()).filter(|&e| edges.uses[e] == 2);
        inner.map(move |e| ((edges.vertices[e][0], edges.vertices[e][1]), sides[e].map(|t| t as usize)))
    }

    fn split_long(&mut self, target: f64) -> usize {
        let length = |e: &(u32, u32)| (self.positions[e.0 as usize] - self.positions[e.1 as usize]).norm();
        let edges = Edges::new(&self.triangles);
        let mut long: Vec<(f64, (u32, u32), [usize; 2])> =
            Self::inner_edges(&edges).map(|(e, t)| (length(&e), e, t)).filter(|l| l.0 > target).collect();
        long.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut touched = vec![false; self.triangles.len()];
        let mut count = 0;
        for (_, (a, b), sides) in long {
            if sides.iter().any(|&t| touched[t]) || self.positions.len() > MAX_VERTICES {
                continue;
            }
            let middle = nalgebra::center(&self.positions[a as usize], &self.positions[b as usize]);
            let m = self.positions.len() as u32;
            self.positions.push(middle);
            for t in sides {
                touched[t] = true;
                let old = self.triangles[t];
                self.triangles[t] = old.map(|v| if v == a { m } else { v });
                self.triangles.push(old.map(|v| if v == b { m } else { v }));
                touched.push(true);
            }
            count += 1;
        }
        count
    }

    /// Flips inner edges whose opposite angles sum to more than 180°.
    fn flip_edges(&mut self, blocked: &dyn Fn(usize, usize) -> bool) -> usize {
        let edges = Edges::new(&self.triangles);
        let mut made: BTreeSet<(u32, u32)> = BTreeSet::new();
        let mut touched = vec![false; self.triangles.len()];
        let mut count = 0;
        for ((a, b), [s, t]) in Self::inner_edges(&edges) {
            if touched[s] || touched[t] {
                continue;
            }
            let (Some((c, ca, cb)), Some((d, _, _))) = (self.opposite(s, a, b), self.opposite(t, a, b)) else {
                continue;
            };
            let new = (c.min(d), c.max(d));
            let both_border = (c as usize) < self.border && (d as usize) < self.border;
            let exists = edges.vertices.binary_search(&[new.0, new.1]).is_ok() || made.contains(&new);
            if c == d || exists || (both_border && blocked(c as usize, d as usize)) {
                continue;
            }
            if self.angle(c, a, b) + self.angle(d, a, b) <= std::f64::consts::PI + 1e-6 {
                continue;
            }
            made.insert(new);
            // (ca, cb) is the edge as triangle s runs along it: ca → cb → c.
            self.triangles[s] = [ca, d, c];
            self.triangles[t] = [d, cb, c];
            touched[s] = true;
            touched[t] = true;
            count += 1;
        }
        count
    }

    /// The corner of triangle `t` opposite to edge ab, and the edge in the triangle's direction.
    fn opposite(&self, t: usize, a: u32, b: u32) -> Option<(u32, u32, u32)> {
        let tri = self.triangles[t];
        (0..3).find(|&k| tri[k] != a && tri[k] != b).map(|k| (tri[k], tri[(k + 1) % 3], tri[(k + 2) % 3]))
    }

    fn angle(&self, at: u32, a: u32, b: u32) -> f64 {
        let p = self.positions[at as usize];
        (self.positions[a as usize] - p).angle(&(self.positions[b as usize] - p))
    }

    /// Moves inner vertices to the mean of their neighbours.
    fn even_out(&mut self, passes: usize) {
        let neighbors = VertexNeighbors::new(self.positions.len(), &self.triangles);
        for _ in 0..passes {
            for v in self.border..self.positions.len() {
                let around = neighbors.of(v);
                if !around.is_empty() {
                    let sum: nalgebra::Vector3<f64> = around.iter().map(|&n| self.positions[n as usize].coords).sum();
                    self.positions[v] = Point3::from(sum / around.len() as f64);
                }
            }
        }
    }
}
