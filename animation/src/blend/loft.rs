//! How high the layers lie over each place of the body.

use nalgebra::Point3;
use rayon::prelude::*;
use toile_character::FREE_PART;
use toile_geometry::{Mesh, topology::VertexNeighbors};

use super::anchors::{Closeness, Over};

/// Thinnest that a layer can be pressed, metres: chosen by trying, on three subjects in one walk, until the layers could be moved
/// apart. No model of cloth stands behind it.
pub(crate) const THINNEST: f32 = 0.0015;
/// Cloth above this height hangs free, metres: chosen in the same way.
pub(crate) const TALLEST: f32 = 0.15;
/// Rings of vertices over which heights spread, and rounds of smoothing after that.
const SPREAD: usize = 3;

/// How high the layers lie over each vertex of the body, in the outfit's first pose.
pub(crate) struct Loft {
    /// Height of the topmost layer, metres.
    pub tops: Vec<f32>,
    /// For each garment, which of the layers over each vertex it is, from 1; the last tells how many there are.
    pub ranks: Vec<Vec<f32>>,
    /// Where the vertices of each garment's mesh stand.
    pub over: Vec<Vec<Over>>,
}

impl Loft {
    /// Of the `garments`, inside to outside.
    pub fn new(garments: &[&Mesh], closeness: &Closeness, neighbours: &VertexNeighbors, body_vertices: usize) -> Self {
        let mut tops = vec![0.0f32; body_vertices];
        let mut rank = vec![0.0f32; body_vertices];
        let (mut over, mut ranks) = (Vec::new(), Vec::new());
        for layer in garments {
            let of_part = layer.attributes.get(FREE_PART);
            let free = |v: usize| of_part.map_or(0.0, |part| part[v]);
            let place = |(v, p): (usize, &Point3<f32>)| closeness.over(p, free(v));
            let places: Vec<Over> = layer.positions.par_iter().enumerate().filter_map(place).collect();
            let mut covered = vec![0.0f32; body_vertices];
            for place in places.iter().filter(|p| p.height < TALLEST && p.held > 0.5) {
                for &v in &place.corners {
                    tops[v as usize] = tops[v as usize].max(place.height);
                    covered[v as usize] = 1.0;
                }
            }
            let covered = (0..SPREAD).fold(covered, |covered, _| widened(&covered, neighbours));
            rank.iter_mut().zip(smoothed(&covered, neighbours, SPREAD)).for_each(|(r, one)| *r += one);
            ranks.push(rank.clone());
            over.push(places);
        }
        let tops = (0..SPREAD).fold(tops, |tops, _| widened(&tops, neighbours));
        Self { tops: smoothed(&tops, neighbours, SPREAD), ranks, over }
    }

    /// Number of layers over vertex `v`.
    pub fn count(&self, v: usize) -> f32 {
        self.ranks.last().map_or(0.0, |ranks| ranks[v])
    }
}

/// Each value, or a neighbour's larger one.
pub(crate) fn widened(values: &[f32], neighbours: &VertexNeighbors) -> Vec<f32> {
    let largest = |v: usize| neighbours.of(v).iter().map(|&u| values[u as usize]).fold(values[v], f32::max);
    (0..values.len()).map(largest).collect()
}

/// Each value after some rounds of moving half of the way to the mean of its neighbours.
pub(crate) fn smoothed(values: &[f32], neighbours: &VertexNeighbors, rounds: usize) -> Vec<f32> {
    let mut values = values.to_vec();
    for _ in 0..rounds {
        let mean = |v: usize| {
            let around = neighbours.of(v);
            let sum: f32 = around.iter().map(|&u| values[u as usize]).sum();
            if around.is_empty() { values[v] } else { 0.5 * values[v] + 0.5 * sum / around.len() as f32 }
        };
        values = (0..values.len()).map(mean).collect();
    }
    values
}
