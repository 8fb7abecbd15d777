//! The effect of stacking on each layer.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use toile_geometry::{
    Mesh,
    holes::FILLED,
    statistics::{Rank, quantile_by},
};

use super::layer::Layer;
use crate::settings::StackSettings;

/// Upper ends of the bins of [`LayerReport::gaps`], millimetres.
pub const GAP_BINS_MM: [f32; 6] = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0];

/// The effect of stacking on one layer.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct LayerReport {
    /// Maximum over the regions of the rounds until nothing was left to push; the limit where something was left.
    pub rounds: usize,
    /// True where every sample has its gap and no triangles cross.
    pub settled: bool,
    /// Pairs of crossing triangles with any lower layer after the last round.
    pub crossing_pairs: usize,
    /// Triangles that were cut out because they still crossed or came too near after the last round.
    pub cut_triangles: usize,
    /// Pairs of triangles of the layer itself that cross, before and after.
    pub self_crossings: [usize; 2],
    /// The gap that this layer should have, metres; four fifths of it are enough.
    pub gap_m: f32,
    /// Smallest height of the layer's vertices over any lower layer, metres.
    pub least_gap_m: f32,
    /// Share of its vertices by their height over the nearest lower layer: bins end at [`GAP_BINS_MM`]; the last one holds
    /// vertices that are further away or over nothing.
    pub gaps: [f32; GAP_BINS_MM.len() + 1],
    /// Mean distance that its vertices moved, metres.
    pub moved_mean_m: f32,
    /// Largest distance that a vertex moved, metres.
    pub moved_max_m: f32,
    /// Mean distance that the vertices moved that the scan saw (attribute `filled` below one half), metres.
    pub moved_seen_mean_m: f32,
    /// 95 % of these vertices moved less than this distance, metres.
    pub moved_seen_p95_m: f32,
}

/// The effect of stacking.
#[derive(Debug, Clone, Default, Serialize)]
pub struct StackReport {
    /// By layer, inside to outside.
    pub layers: Vec<LayerReport>,
}

impl LayerReport {
    /// Reads the heights of the last layer's vertices over the nearest layer below.
    pub(super) fn read_gaps(&mut self, layers: &[Layer], settings: &StackSettings) {
        let Some((upper, lowers)) = layers.split_last() else { return };
        let height = |lower: &Layer, p| lower.surface.height(p, settings.reach);
        let least = |p| lowers.iter().filter_map(|lower| height(lower, p)).fold(f32::INFINITY, f32::min);
        let heights: Vec<f32> = upper.mesh().positions.par_iter().map(least).collect();
        self.least_gap_m = heights.iter().copied().fold(settings.reach, f32::min);
        for h in &heights {
            let bin = GAP_BINS_MM.iter().position(|end| h * 1e3 < *end).unwrap_or(GAP_BINS_MM.len());
            self.gaps[bin] += 1.0 / heights.len() as f32;
        }
    }

    /// Reads how far the vertices of a layer moved.
    pub(super) fn read_moves(&mut self, layer: &Mesh, moved: &[f32]) {
        let mean = |m: &[f32]| m.iter().sum::<f32>() / m.len().max(1) as f32;
        (self.moved_mean_m, self.moved_max_m) = (mean(moved), moved.iter().copied().fold(0.0, f32::max));
        let filled = layer.attributes.get(FILLED);
        let seen = |v: usize| filled.is_none_or(|f| f[v] < 0.5);
        let mut seen: Vec<f32> = (0..moved.len()).filter(|&v| seen(v)).map(|v| moved[v]).collect();
        self.moved_seen_mean_m = mean(&seen);
        self.moved_seen_p95_m = quantile_by(&mut seen, 0.95, Rank::Count).unwrap_or(0.0);
    }
}
