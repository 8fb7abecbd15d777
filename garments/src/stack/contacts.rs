//! Contacts between all pairs of layers, found round after round without looking at everything each time.

use rayon::prelude::*;

use super::{
    contact::{Anchor, Contact, crossing_contacts, probe},
    layer::Layer,
    region::Region,
    swept::Swept,
};

/// Lower vertices are looked at when the upper layer is this near, metres.
const NEAR: f32 = 0.02;
/// Samples in a parallel chunk.
const CHUNK: usize = 512;

/// The slack of each sample of each pair of layers: how far things may move before it can need a push, metres. A round
/// looks only at samples without slack.
pub(super) struct Contacts {
    pairs: Vec<Pair>,
}

struct Pair {
    upper: usize,
    lower: usize,
    /// Slack of the upper layer's vertices.
    vertices: Vec<f32>,
    /// Slack of the lower layer's vertices.
    lower_vertices: Vec<f32>,
}

impl Contacts {
    /// All pairs of `layers`, which lie inside to outside.
    pub fn new(layers: &[Layer]) -> Self {
        let count = |k: usize| layers[k].mesh().positions.len();
        let worn: Vec<usize> = (0..layers.len()).filter(|&k| count(k) > 0).collect();
        let below = |&upper: &usize| worn.iter().filter(move |&&l| l < upper).map(move |&lower| (upper, lower));
        let pairs = worn.iter().flat_map(below).map(|(upper, lower)| Pair {
            upper,
            lower,
            vertices: vec![0.0; count(upper)],
            lower_vertices: vec![0.0; count(lower)],
        });
        Self { pairs: pairs.collect() }
    }

    /// Takes the distances that vertices of each layer `moved` in some `regions` off the slacks (nothing moved outside
    /// of them; the distances of a layer are empty where it stayed). Samples beyond `reach` metres of all stay as they are.
    pub fn moved_in(&mut self, regions: &[Region], moved: &[Vec<f32>], layers: &[Layer], reach: f32) {
        let swept = |(layer, moved): (&Layer, &Vec<f32>)| -> Vec<Swept> {
            let new = |r: &Region| Swept::new(&layer.mesh().positions, moved, r, reach);
            if moved.is_empty() { Vec::new() } else { regions.iter().map(new).collect() }
        };
        let swept: Vec<Vec<Swept>> = layers.iter().zip(moved).map(swept).collect();
        for pair in &mut self.pairs {
            let (upper, lower) = (pair.upper, pair.lower);
            let sides = [(&mut pair.vertices, upper, lower), (&mut pair.lower_vertices, lower, upper)];
            for (slacks, own, other) in sides {
                for ((v, slack), p) in slacks.iter_mut().enumerate().zip(&layers[own].mesh().positions) {
                    let of_other = swept[other].iter().map(|s| s.at(p)).fold(0.0, f32::max);
                    *slack -= moved[own].get(v).copied().unwrap_or(0.0) + of_other;
                }
            }
        }
    }

    /// Contacts of upper vertices, and of the upper points nearest to lower vertices, that lack their gap. Lower layers
    /// are looked for within `reach` metres.
    pub fn samples(&mut self, layers: &[Layer], reach: f32) -> Vec<Contact> {
        let mut found = Vec::new();
        for Pair { upper, lower, vertices, lower_vertices } in &mut self.pairs {
            let (over, gap) = (&layers[*upper].surface, layers[*upper].gap);
            let of_vertex = |v: usize| {
                let anchor = Anchor { layer: *upper, corners: [v as u32; 3], weights: [1.0, 0.0, 0.0] };
                probe(layers, anchor, &over.mesh.positions[v], *lower, reach)
            };
            let of_lower_vertex = |u: usize| {
                let hit = over.bvh.closest(&layers[*lower].mesh().positions[u], NEAR);
                let Some(hit) = hit else { return (NEAR - gap, None) };
                let corners = over.mesh.triangles[hit.triangle as usize];
                let anchor = Anchor { layer: *upper, corners, weights: hit.barycentric };
                probe(layers, anchor, &hit.point, *lower, NEAR)
            };
            found.extend(look(vertices, of_vertex));
            found.extend(look(lower_vertices, of_lower_vertex));
        }
        found
    }

    /// Contacts wherever an edge of a layer passes through a triangle of another; the upper has to move by this many
    /// `gaps` along the lower one's normal.
    pub fn crossings(&self, layers: &[Layer], gaps: f32) -> Vec<Contact> {
        let of_pair = |pair: &Pair| {
            let distance = gaps * layers[pair.upper].gap;
            crossing_contacts(layers, [pair.upper, pair.lower], distance)
        };
        self.pairs.iter().flat_map(of_pair).collect()
    }
}

/// Probes every sample that has no slack left; renews the slacks and returns the contacts in order.
fn look(slacks: &mut [f32], probe: impl Fn(usize) -> (f32, Option<Contact>) + Sync) -> Vec<Contact> {
    let found: Vec<Vec<Contact>> = slacks
        .par_chunks_mut(CHUNK)
        .enumerate()
        .map(|(chunk, slacks)| {
            let mut found = Vec::new();
            for (i, slack) in slacks.iter_mut().enumerate().filter(|(_, s)| **s <= 0.0) {
                let (renewed, contact) = probe(chunk * CHUNK + i);
                *slack = renewed;
                found.extend(contact);
            }
            found
        })
        .collect();
    found.concat()
}
