//! Pieces that look new because something was taken off above them.

use super::types::{Labels, Reason};
use crate::measure::Measured;

/// Scan this far inside the surface worn before was uncovered or pressed in, metres, and at least this many noise scales.
const INSIDE: f32 = 0.003;
const INSIDE_NOISE: f32 = 2.0;
/// A piece that lies inside with this share of its area was uncovered: new cloth lies outside.
const MOSTLY: f32 = 0.4;
/// Log odds of vertices that are not new, nats.
const NOT_NEW: f32 = -3.0;

/// The labels without pieces that lie mostly inside the surface worn before.
pub(super) fn drop_uncovered(labels: Labels, on: &Measured) -> Labels {
    let (graph, evidence) = (&on.graph, &on.evidence);
    let inside = INSIDE.max(INSIDE_NOISE * evidence.height_noise);
    let (set, areas) = graph.components(|v| labels.garment[v]);
    let mut sunken = vec![0.0f32; areas.len()];
    for v in (0..graph.len()).filter(|&v| set[v] != u32::MAX && evidence.height[v] < -inside) {
        sunken[set[v] as usize] += graph.areas[v];
    }
    let uncovered = |set: u32| set != u32::MAX && sunken[set as usize] > MOSTLY * areas[set as usize];
    let gone: Vec<u32> = (0..graph.len() as u32).filter(|&v| uncovered(set[v as usize])).collect();
    labels.without(&gone, NOT_NEW, Reason::Uncovered)
}
