//! Patches that look new because cloth that was worn before swung there.

use std::collections::VecDeque;

use super::types::{Labels, Reason};
use crate::measure::{Measured, color};

/// Cloth worn before swings by at most this share of its distance from the body.
const SWING: f32 = 0.6;
/// Cloth nearer to the body than this does not swing, metres.
const LOOSE: f32 = 0.02;
/// Colours that differ by less than this many noise scales are the same.
const SAME_COLOR: f32 = 3.0;
/// Normals of one cloth differ by less than this (cosine) from vertex to vertex: over a hem's step they differ more.
const ONE_CLOTH: f32 = 0.8;
/// A patch swung when it has this share of its border with old surface; the rest may be new cloth that lies over it.
const AMONG_OLD: f32 = 0.6;
/// Log odds of vertices that are not new, nats.
const NOT_NEW: f32 = -3.0;

/// The labels without patches that earlier cloth can have become by swinging: loose there, of its colour, and one cloth
/// with what still hangs where it did.
pub(super) fn drop_swung(labels: Labels, on: &Measured) -> Labels {
    let (graph, evidence) = (&on.graph, &on.evidence);
    if graph.lab.is_empty() {
        return labels;
    }
    let reached = reached_from_old(on, &labels);
    let same = SAME_COLOR * evidence.color_noise;
    let near = |v: usize| {
        let slack = evidence.body_distance[v] - evidence.height[v];
        slack > LOOSE && evidence.height[v].abs() < SWING * slack
    };
    // The fold at the edge of the reached vertices belongs to them.
    let fold = |v: usize| graph.neighbors.of(v).iter().any(|&n| reached[n as usize]);
    let may = |v: usize| labels.garment[v] && (reached[v] || fold(v) || (near(v) && evidence.color[v] < same));
    let (set, areas) = graph.components(may);
    let patches = patches(on, &labels, &reached, &set, areas.len());
    let swung = |set: u32| set != u32::MAX && patches[set as usize].swung();
    let gone: Vec<u32> = (0..graph.len() as u32).filter(|&v| swung(set[v as usize])).collect();
    labels.without(&gone, NOT_NEW, Reason::Swung)
}

/// The border of a patch that may have swung.
#[derive(Clone, Copy, Default)]
struct Patch {
    /// Border with old surface, metres.
    to_old: f32,
    /// Border with new cloth, metres.
    to_new: f32,
    /// True where old cloth goes on into the patch.
    goes_on: bool,
}

impl Patch {
    fn swung(&self) -> bool {
        self.goes_on && self.to_old > AMONG_OLD * (self.to_old + self.to_new)
    }
}

fn patches(on: &Measured, labels: &Labels, reached: &[bool], set: &[u32], count: usize) -> Vec<Patch> {
    let mut patches = vec![Patch::default(); count];
    for (&[i, j], &length) in on.graph.edges.iter().zip(&on.graph.dual_lengths) {
        for (v, n) in [(i as usize, j as usize), (j as usize, i as usize)] {
            if set[v] != u32::MAX && set[n] != set[v] {
                let patch = &mut patches[set[v] as usize];
                *(if labels.garment[n] { &mut patch.to_new } else { &mut patch.to_old }) += length;
                patch.goes_on |= reached[v] && !labels.garment[n];
            }
        }
    }
    patches
}

/// Vertices of the garment that old ones of the same colour go on into, without a step, as far as cloth swings there.
fn reached_from_old(on: &Measured, labels: &Labels) -> Vec<bool> {
    let (graph, evidence) = (&on.graph, &on.evidence);
    let same = SAME_COLOR * evidence.color_noise;
    let mut best = vec![f32::INFINITY; graph.len()];
    let mut origin: Vec<u32> = (0..graph.len() as u32).collect();
    let mut queue: VecDeque<u32> = origin.iter().copied().filter(|&v| !labels.garment[v as usize]).collect();
    queue.iter().for_each(|&v| best[v as usize] = 0.0);
    while let Some(v) = queue.pop_front() {
        let from = origin[v as usize];
        for &n in graph.neighbors.of(v as usize) {
            let (v, n) = (v as usize, n as usize);
            let far = best[v] + graph.step(v, n);
            let goes_on = graph.normals[v].dot(&graph.normals[n]) > ONE_CLOTH
                && color::difference(&graph.lab[from as usize], &graph.lab[n]) < same;
            let loose = evidence.body_distance[n] > LOOSE.max(far / SWING);
            if labels.garment[n] && goes_on && loose && far < best[n] {
                (best[n], origin[n]) = (far, from);
                queue.push_back(n as u32);
            }
        }
    }
    (0..graph.len()).map(|v| labels.garment[v] && best[v].is_finite()).collect()
}
