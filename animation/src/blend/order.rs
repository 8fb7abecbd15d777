//! Layers at full resolution, each outside all layers below it.
//!
//! From inside to outside, each layer is moved away from the finished ones below: its vertices to a gap above them, and its
//! triangles beyond the lower vertices that stick out. The moves are spread over the neighbours, so that no dent
//! is left, and repeated; where triangles still cross, by an exact test, their corners are moved farther.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_geometry::{Mesh, bvh::Bvh, intersection::crossings, mesh::vertex_normals, topology::VertexNeighbors};

use super::tracker::{NONE, Tracker};

/// Largest distance between layers that are looked at, in the outfit's first pose, metres.
const REACH: f32 = 0.08;
/// Gap that layers keep where the scan had as much, metres: edges of 8 mm over a limb of 30 mm radius cut off 0.3 mm.
const GAP: f32 = 0.0010;
/// Smallest gap, metres.
const SMALLEST_GAP: f32 = 0.0003;
/// Farthest that a vertex is moved in one look, metres.
const FARTHEST: f32 = 0.02;
/// Looks at the heights before triangles are tested.
const LOOKS: usize = 4;
/// Times that triangles which cross are moved farther.
const ROUNDS: usize = 6;

/// What lies over what.
pub(crate) struct Order {
    trackers: Vec<Tracker>,
    neighbours: Vec<VertexNeighbors>,
    /// For each upper layer, each lower one.
    pairs: Vec<Vec<Pair>>,
}

/// An upper layer over a lower one, in the outfit's first pose.
struct Pair {
    /// Triangle of the lower layer below each vertex of the upper one.
    below: Vec<u32>,
    /// Gap that each vertex of the upper layer keeps.
    gaps: Vec<f32>,
    /// Triangle of the upper layer above each vertex of the lower one.
    above: Vec<u32>,
}

/// Where the places were found in the last pose.
#[derive(Debug, Clone)]
pub(crate) struct Followed {
    below: Vec<Vec<Vec<u32>>>,
    above: Vec<Vec<Vec<u32>>>,
}

impl Order {
    pub fn new(layers: &[&Mesh]) -> Self {
        let trackers: Vec<Tracker> = layers.iter().map(|m| Tracker::new(m)).collect();
        let normals: Vec<Vec<Vector3<f32>>> = layers.iter().map(|m| m.vertex_normals()).collect();
        let neighbours = layers.iter().map(|m| VertexNeighbors::new(m.positions.len(), &m.triangles)).collect();
        let pair = |upper: usize, lower: usize| {
            let (u, l) = (layers[upper], layers[lower]);
            let below = trackers[lower].start(&l.positions, &u.positions, REACH);
            let gap = |v: usize| {
                if below[v] == NONE {
                    return GAP;
                }
                let place = trackers[lower].follow(&l.positions, &normals[lower], &u.positions[v], below[v]);
                (0.8 * place.height).clamp(SMALLEST_GAP, GAP)
            };
            let gaps = (0..u.positions.len()).map(gap).collect();
            let above = trackers[upper].start(&u.positions, &l.positions, REACH);
            Pair { below, gaps, above }
        };
        let all: Vec<(usize, usize)> = (0..layers.len()).flat_map(|u| (0..u).map(move |l| (u, l))).collect();
        let mut found = all.par_iter().map(|&(u, l)| pair(u, l)).collect::<Vec<_>>().into_iter();
        let pairs = (0..layers.len()).map(|u| found.by_ref().take(u).collect()).collect();
        Self { trackers, neighbours, pairs }
    }

    /// Places as they are in the outfit's first pose.
    pub fn start(&self) -> Followed {
        let of = |pick: fn(&Pair) -> &Vec<u32>| -> Vec<Vec<Vec<u32>>> {
            self.pairs.iter().map(|lower| lower.iter().map(|p| pick(p).clone()).collect()).collect()
        };
        Followed { below: of(|p| &p.below), above: of(|p| &p.above) }
    }

    /// Moves the garments among `layers` apart. Returns the pairs of triangles that still cross.
    pub fn settle(&self, layers: &mut [Vec<Point3<f32>>], followed: &mut Followed) -> usize {
        let mut left = 0;
        for upper in 1..layers.len() {
            let (lower, rest) = layers.split_at_mut(upper);
            left += self.settle_one(upper, lower, &mut rest[0], followed);
        }
        left
    }

    fn settle_one(
        &self,
        upper: usize,
        lower: &[Vec<Point3<f32>>],
        positions: &mut Vec<Point3<f32>>,
        followed: &mut Followed,
    ) -> usize {
        let lower_normals: Vec<Vec<Vector3<f32>>> =
            lower.par_iter().enumerate().map(|(k, p)| vertex_normals(p, &self.trackers[k].triangles)).collect();
        for look in 0..LOOKS {
            let push = self.push(upper, lower, &lower_normals, positions, followed);
            if !self.spread(upper, push, positions, look + 1 < LOOKS) {
                break;
            }
        }
        let mut mesh = Mesh::new(positions.clone(), self.trackers[upper].triangles.clone());
        let below: Vec<(Mesh, Bvh)> = lower
            .par_iter()
            .enumerate()
            .map(|(k, p)| {
                let bvh = Bvh::new(p, &self.trackers[k].triangles);
                (Mesh::new(p.clone(), self.trackers[k].triangles.clone()), bvh)
            })
            .collect();
        let mut left = 0;
        for round in 0..=ROUNDS {
            let found: Vec<Vec<[u32; 2]>> = below.iter().map(|(m, bvh)| crossings(&mesh, m, bvh)).collect();
            left = found.iter().map(Vec::len).sum();
            if left == 0 || round == ROUNDS {
                break;
            }
            let mut push = vec![Vector3::zeros(); positions.len()];
            for (k, pairs) in found.iter().enumerate() {
                for &[t, u] in pairs {
                    let out = self.trackers[k].triangles[u as usize].map(|v| lower_normals[k][v as usize]);
                    let out = (out[0] + out[1] + out[2]).try_normalize(1e-6).unwrap_or_default();
                    for v in mesh.triangles[t as usize] {
                        keep_longer(&mut push[v as usize], out * (GAP * (1.0 + round as f32)));
                    }
                }
            }
            self.spread(upper, push, &mut mesh.positions, true);
            let push = self.push(upper, lower, &lower_normals, &mesh.positions, followed);
            self.spread(upper, push, &mut mesh.positions, false);
        }
        *positions = mesh.positions;
        left
    }

    /// How far each vertex must move to lie over all lower layers, and they below it.
    fn push(
        &self,
        upper: usize,
        lower: &[Vec<Point3<f32>>],
        lower_normals: &[Vec<Vector3<f32>>],
        positions: &[Point3<f32>],
        followed: &mut Followed,
    ) -> Vec<Vector3<f32>> {
        let own = &self.trackers[upper];
        let own_normals = vertex_normals(positions, &own.triangles);
        let mut push = vec![Vector3::zeros(); positions.len()];
        for (k, below) in lower.iter().enumerate() {
            let tracker = &self.trackers[k];
            let gaps = &self.pairs[upper][k].gaps;
            let places = &mut followed.below[upper][k];
            push.par_iter_mut().zip(places).zip(positions).zip(gaps).for_each(|(((push, place), p), gap)| {
                if *place == NONE {
                    return;
                }
                let at = tracker.follow(below, &lower_normals[k], p, *place);
                *place = at.triangle;
                if at.height < *gap && at.is_over() {
                    keep_longer(push, at.normal * (gap - at.height).min(FARTHEST));
                }
            });
            let sticking: Vec<(u32, f32, Vector3<f32>)> = followed.above[upper][k]
                .par_iter_mut()
                .zip(below)
                .filter_map(|(place, p)| {
                    if *place == NONE {
                        return None;
                    }
                    let at = own.follow(positions, &own_normals, p, *place);
                    *place = at.triangle;
                    let out = at.height + SMALLEST_GAP;
                    (out > 0.0 && at.is_over()).then_some((at.triangle, out.min(FARTHEST), at.normal))
                })
                .collect();
            for (t, out, normal) in sticking {
                own.triangles[t as usize].iter().for_each(|&v| keep_longer(&mut push[v as usize], normal * out));
            }
        }
        push
    }

    /// Moves `positions` by `push`, spread over the neighbours where `smooth`. False where nothing moves.
    fn spread(&self, layer: usize, push: Vec<Vector3<f32>>, positions: &mut [Point3<f32>], smooth: bool) -> bool {
        if push.iter().all(|p| *p == Vector3::zeros()) {
            return false;
        }
        let mut moves = push.clone();
        if smooth {
            for _ in 0..3 {
                let before = moves.clone();
                for (v, m) in moves.iter_mut().enumerate() {
                    let around = self.neighbours[layer].of(v);
                    let mean = around.iter().map(|&u| before[u as usize]).sum::<Vector3<f32>>() / around.len().max(1) as f32;
                    // Never less than what is needed.
                    *m = push[v];
                    keep_longer(m, mean);
                }
            }
        }
        positions.iter_mut().zip(moves).for_each(|(p, m)| *p += m);
        true
    }
}

fn keep_longer(held: &mut Vector3<f32>, other: Vector3<f32>) {
    if other.norm_squared() > held.norm_squared() {
        *held = other;
    }
}
