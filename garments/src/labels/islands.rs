//! Small islands of either label.

use super::types::{Labels, Reason};
use crate::{measure::scan_graph::ScanGraph, settings::ExtractSettings};

/// An island of old surface inside the garment becomes new up to this share of `least_area`, whatever its evidence.
const ISLAND_SHARE: f32 = 0.2;

/// The labels with small islands of old surface turned over, and of the garment's pieces only the large ones kept.
pub(crate) fn drop_islands(labels: Labels, graph: &ScanGraph, settings: &ExtractSettings) -> Labels {
    let (set, areas) = graph.components(|v| !labels.garment[v]);
    let is_island = |&v: &usize| set[v] != u32::MAX && areas[set[v] as usize] < ISLAND_SHARE * settings.least_area;
    let labels = labels.turned((0..graph.len()).filter(is_island), Reason::Island);
    let (set, areas) = graph.components(|v| labels.garment[v]);
    let largest = areas.iter().copied().fold(0.0, f32::max);
    let keep = |a: f32| a >= settings.least_area && a >= settings.piece_share * largest;
    let is_small = |&v: &usize| set[v] != u32::MAX && !keep(areas[set[v] as usize]);
    labels.turned((0..graph.len()).filter(is_small), Reason::SmallPiece)
}
