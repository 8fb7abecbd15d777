//! What looks new and is not: earlier layers that swung, and what was uncovered.

use std::collections::VecDeque;

use crate::{color, evidence::Evidence, labels::Labels, scan_graph::ScanGraph};

/// Cloth worn before swings by at most this share of its distance from the body.
const SWING: f32 = 0.6;
/// Cloth nearer to the body than this does not swing, metres.
const LOOSE: f32 = 0.02;
/// Colours that differ by less than this many noise scales are the same.
const SAME_COLOR: f32 = 3.0;
/// Normals of one cloth differ by less than this (cosine) from vertex to vertex: over a hem's step they differ more.
const ONE_CLOTH: f32 = 0.8;
/// A patch swung when this share of its border is what was worn before; the rest may be new cloth that lies over it.
const AMONG_OLD: f32 = 0.6;
/// Scan this far inside what was worn before was uncovered or pressed in, metres, and at least this many noise scales.
const INSIDE: f32 = 0.003;
const INSIDE_NOISE: f32 = 2.0;
/// A piece that lies inside with this share of its area was uncovered: new cloth lies outside.
const MOSTLY: f32 = 0.4;
/// Log odds given to what is not new, nats.
const NOT_NEW: f32 = -3.0;

/// Takes patches that earlier cloth can have become by swinging out of the garment: loose there, of its colour, and one
/// cloth with what still hangs where it did.
pub fn drop_swung(graph: &ScanGraph, evidence: &Evidence, labels: &mut Labels) {
    if graph.lab.is_empty() {
        return;
    }
    let reached = reached_from_old(graph, evidence, labels);
    let same = SAME_COLOR * evidence.color_noise;
    let near = |v: usize| {
        let slack = evidence.body_distance[v] - evidence.height[v];
        slack > LOOSE && evidence.height[v].abs() < SWING * slack
    };
    // The fold at the edge of what is reached belongs to it.
    let fold = |v: usize| graph.neighbors.of(v).iter().any(|&n| reached[n as usize]);
    let may = |v: usize| labels.garment[v] && (reached[v] || fold(v) || (near(v) && evidence.color[v] < same));
    let (set, areas) = graph.components(may);
    // Border to what was worn before, border to new cloth, and whether old cloth goes on into the patch.
    let (mut border, mut connected) = (vec![[0.0f32; 2]; areas.len()], vec![false; areas.len()]);
    for (&[i, j], &length) in graph.edges.iter().zip(&graph.dual_lengths) {
        for (v, n) in [(i as usize, j as usize), (j as usize, i as usize)] {
            if set[v] != u32::MAX && set[n] != set[v] {
                border[set[v] as usize][usize::from(labels.garment[n])] += length;
                connected[set[v] as usize] |= reached[v] && !labels.garment[n];
            }
        }
    }
    let swung = |k: usize| connected[k] && border[k][0] > AMONG_OLD * (border[k][0] + border[k][1]);
    drop_sets(labels, &set, swung);
}

/// Vertices of the garment that old ones of the same colour go on into, without a step, as far as cloth swings there.
fn reached_from_old(graph: &ScanGraph, evidence: &Evidence, labels: &Labels) -> Vec<bool> {
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

/// Takes pieces that lie inside what was worn before out of the garment: something was taken off. Returns their area,
/// square metres.
pub fn drop_uncovered(graph: &ScanGraph, evidence: &Evidence, labels: &mut Labels) -> f32 {
    let inside = INSIDE.max(INSIDE_NOISE * evidence.height_noise);
    let (set, areas) = graph.components(|v| labels.garment[v]);
    let mut sunken = vec![0.0f32; areas.len()];
    for v in (0..graph.len()).filter(|&v| set[v] != u32::MAX && evidence.height[v] < -inside) {
        sunken[set[v] as usize] += graph.areas[v];
    }
    let uncovered = |k: usize| sunken[k] > MOSTLY * areas[k];
    drop_sets(labels, &set, uncovered);
    (0..areas.len()).filter(|&k| uncovered(k)).map(|k| areas[k]).sum()
}

fn drop_sets(labels: &mut Labels, set: &[u32], gone: impl Fn(usize) -> bool) {
    for v in (0..set.len()).filter(|&v| set[v] != u32::MAX && gone(set[v] as usize)) {
        labels.garment[v] = false;
        labels.log_odds[v] = labels.log_odds[v].min(NOT_NEW);
    }
}
