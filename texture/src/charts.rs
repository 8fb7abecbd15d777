//! Charts: connected parts of a surface that look one way, and so can be laid flat by projection.

use std::{cmp::Reverse, collections::BinaryHeap};

use nalgebra::Vector3;
use toile_geometry::{Mesh, topology::Edges};

/// Smallest cosine between a triangle's normal and its chart's axis: 52 degrees. Wider charts are larger and fewer, and
/// stretch their rims more: here to 1.6 times.
const CONE: f32 = 0.616;
/// Largest distance of a triangle from the seed of its chart, metres: compact charts pack well.
const RADIUS: f32 = 0.17;
/// The same where a small chart's triangles join a neighbouring one: 72 degrees.
const JOINS: f32 = 0.31;
/// Charts of fewer triangles join their neighbours where they can.
const SMALL: usize = 60;
/// Rounds in which a chart grows about the mean of what it was before.
const ROUNDS: usize = 3;
/// Triangles around a seed whose mean normal it starts with.
const START: usize = 300;

/// No chart.
const NONE: u32 = u32::MAX;

/// A mesh as charts see it.
pub(crate) struct Faces<'a> {
    mesh: &'a Mesh,
    normals: Vec<Vector3<f32>>,
    /// Area times normal.
    weighted: Vec<Vector3<f32>>,
    centres: Vec<Vector3<f32>>,
    /// The triangles at each side, `u32::MAX` for none.
    beside: Vec<[u32; 3]>,
}

impl<'a> Faces<'a> {
    pub(crate) fn new(mesh: &'a Mesh) -> Self {
        let edges = Edges::new(&mesh.triangles);
        let pairs = edges.triangles();
        let other = |t: usize, e: u32| {
            let [a, b] = pairs[e as usize];
            // More than two at an edge have no neighbours there.
            if edges.uses[e as usize] != 2 {
                NONE
            } else if a as usize == t {
                b
            } else {
                a
            }
        };
        let beside = edges.of_triangle.iter().enumerate().map(|(t, sides)| sides.map(|e| other(t, e))).collect();
        let crosses = (0..mesh.triangles.len()).map(|t| {
            let [a, b, c] = mesh.corners(t);
            (b - a).cross(&(c - a)) * 0.5
        });
        let centre = |t: usize| {
            let [a, b, c] = mesh.corners(t);
            (a.coords + b.coords + c.coords) / 3.0
        };
        Self {
            mesh,
            normals: mesh.triangle_normals(),
            weighted: crosses.collect(),
            centres: (0..mesh.triangles.len()).map(centre).collect(),
            beside,
        }
    }

    /// Charts that hold every triangle of `of` once.
    pub(crate) fn charts(&self, of: &[u32]) -> Vec<Vec<u32>> {
        let mut chart_of = vec![NONE; self.mesh.triangles.len()];
        let mut is_free = vec![false; self.mesh.triangles.len()];
        of.iter().for_each(|&t| is_free[t as usize] = true);
        let mut charts = Vec::new();
        for &seed in of {
            if is_free[seed as usize] {
                let chart = self.grow_settled(seed, &is_free);
                for &t in &chart {
                    is_free[t as usize] = false;
                    chart_of[t as usize] = charts.len() as u32;
                }
                charts.push(chart);
            }
        }
        self.join_small(&mut charts, &mut chart_of);
        charts.retain(|chart| !chart.is_empty());
        charts
    }

    /// Triangles with those beside them.
    pub(crate) fn with_neighbours(&self, triangles: &[u32]) -> Vec<u32> {
        let beside = triangles.iter().flat_map(|&t| self.beside[t as usize]).filter(|&n| n != NONE);
        triangles.iter().copied().chain(beside).collect()
    }

    /// The mean direction of a chart's triangles.
    pub(crate) fn axis(&self, chart: &[u32]) -> Vector3<f32> {
        let sum: Vector3<f32> = chart.iter().map(|&t| self.weighted[t as usize]).sum();
        sum.try_normalize(1e-12).unwrap_or_else(Vector3::z)
    }

    /// Whether a triangle can lie in a chart with this axis: it is not seen from behind nor nearly from the side.
    pub(crate) fn fits(&self, triangle: u32, axis: &Vector3<f32>) -> bool {
        self.normals[triangle as usize].dot(axis) > JOINS / 2.0
    }

    /// A chart from a seed, grown again about its own axis until that rests.
    fn grow_settled(&self, seed: u32, is_free: &[bool]) -> Vec<u32> {
        let own = self.normals[seed as usize];
        let near = self.axis(&self.grow(seed, is_free, &own, START));
        let mut axis = if own.dot(&near) > CONE { near } else { own };
        let mut chart = self.grow(seed, is_free, &own, 1);
        for _ in 0..ROUNDS {
            let grown = self.grow(seed, is_free, &axis, usize::MAX);
            let next = self.axis(&grown);
            // The seed stays inside of the cone, or it would never lie in any chart.
            if grown.len() <= chart.len() || self.normals[seed as usize].dot(&next) < CONE {
                break;
            }
            (axis, chart) = (next, grown);
        }
        chart
    }

    /// Free triangles around a seed inside the cone about `axis`, nearest first; the seed whatever it looks like.
    fn grow(&self, seed: u32, is_free: &[bool], axis: &Vector3<f32>, most: usize) -> Vec<u32> {
        let start = self.centres[seed as usize];
        let mut queue = BinaryHeap::from([Reverse((0u32, seed))]);
        let mut taken = std::collections::BTreeSet::from([seed]);
        let mut chart = Vec::new();
        while let Some(Reverse((_, t))) = queue.pop() {
            chart.push(t);
            if chart.len() >= most {
                break;
            }
            for next in self.beside[t as usize] {
                let fits = next != NONE && is_free[next as usize] && self.normals[next as usize].dot(axis) > CONE;
                let distance = if fits { (self.centres[next as usize] - start).norm() } else { f32::MAX };
                if distance < RADIUS && taken.insert(next) {
                    // Distances are not negative: their bits are in their order.
                    queue.push(Reverse((distance.to_bits(), next)));
                }
            }
        }
        chart
    }

    /// Gives the triangles of small charts to neighbouring larger ones that they can lie in.
    fn join_small(&self, charts: &mut [Vec<u32>], chart_of: &mut [u32]) {
        let axes: Vec<Vector3<f32>> = charts.iter().map(|chart| self.axis(chart)).collect();
        for small in 0..charts.len() {
            if charts[small].len() >= SMALL {
                continue;
            }
            let mut rest = std::mem::take(&mut charts[small]);
            loop {
                let before = rest.len();
                rest.retain(|&t| {
                    let beside =
                        self.beside[t as usize].into_iter().filter(|&n| n != NONE).map(|n| chart_of[n as usize]);
                    let others =
                        beside.filter(|&c| c as usize != small && c != NONE && charts[c as usize].len() >= SMALL);
                    let cosine = |c: u32| self.normals[t as usize].dot(&axes[c as usize]);
                    let best = others.max_by(|&a, &b| cosine(a).total_cmp(&cosine(b)).then(b.cmp(&a)));
                    let Some(best) = best.filter(|&c| cosine(c) > JOINS) else { return true };
                    chart_of[t as usize] = best;
                    charts[best as usize].push(t);
                    false
                });
                if rest.len() == before {
                    break;
                }
            }
            charts[small] = rest;
        }
    }
}
