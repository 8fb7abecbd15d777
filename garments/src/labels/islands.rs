//! Small islands of either label.

use super::types::{Labels, Reason};
use crate::{measure::scan_graph::ScanGraph, settings::ExtractSettings};

/// An island of old surface inside the garment becomes new up to this share of `least_area`, whatever its evidence.
const ISLAND_SHARE: f32 = 0.2;

/// An island of old surface up to this area, square metres, becomes new where its evidence is weak. What openings of
/// clothes show of a person (a hand, a foot, a head) is at least twice as large.
const LARGEST_ISLAND: f32 = 0.02;
/// The evidence of an island is weak where its mean log odds lie above this, nats: half-way between those of a step (-2,
/// `hem`) and of bare skin and cloth that lies as it did (-4 and less).
const DOUBTFUL: f32 = -3.0;

/// The labels with small islands of old surface turned over, and of the garment's pieces only the large ones kept.
pub(crate) fn drop_islands(labels: Labels, graph: &ScanGraph, settings: &ExtractSettings) -> Labels {
    let (set, areas) = graph.components(|v| !labels.garment[v]);
    let is_island = |&v: &usize| set[v] != u32::MAX && areas[set[v] as usize] < ISLAND_SHARE * settings.least_area;
    let labels = labels.turned((0..graph.len()).filter(is_island), Reason::Island);
    let labels = fill_doubtful(labels, graph, &set, &areas);
    let (set, areas) = graph.components(|v| labels.garment[v]);
    let largest = areas.iter().copied().fold(0.0, f32::max);
    let keep = |a: f32| a >= settings.least_area && a >= settings.piece_share * largest;
    let is_small = |&v: &usize| set[v] != u32::MAX && !keep(areas[set[v] as usize]);
    labels.turned((0..graph.len()).filter(is_small), Reason::SmallPiece)
}

/// The labels with those islands of old surface turned over whose evidence is weak, and their log odds even, so that their
/// surroundings decide when labels are minimised again.
fn fill_doubtful(mut labels: Labels, graph: &ScanGraph, set: &[u32], areas: &[f32]) -> Labels {
    let mut sums = vec![0.0_f32; areas.len()];
    for v in (0..graph.len()).filter(|&v| set[v] != u32::MAX) {
        sums[set[v] as usize] += graph.areas[v] * labels.log_odds[v];
    }
    let is_doubtful = |set: u32| {
        set != u32::MAX && areas[set as usize] < LARGEST_ISLAND && sums[set as usize] > DOUBTFUL * areas[set as usize]
    };
    for v in (0..graph.len()).filter(|&v| is_doubtful(set[v])) {
        labels.log_odds[v] = labels.log_odds[v].max(0.0);
        labels.decide(v, true, Reason::Island);
    }
    labels
}
