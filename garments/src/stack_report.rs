//! What stacking did to each layer.

use rayon::prelude::*;
use serde::Serialize;
use toile_geometry::Mesh;

use crate::{StackSettings, worn_surface::WornSurface};

/// Upper ends of the bins of [`LayerReport::gaps`], millimetres.
pub const GAP_BINS_MM: [f32; 6] = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0];

/// What stacking did to one layer.
#[derive(Debug, Clone, Default, Serialize)]
pub struct LayerReport {
    /// Most rounds that a region took until nothing was left to push there, or the most allowed.
    pub rounds: usize,
    /// True where every sample has its gap and no triangles cross.
    pub settled: bool,
    /// Pairs of crossing triangles with any lower layer after the last round.
    pub crossing_pairs: usize,
    /// Triangles that were cut out because they crossed or came too near to the last.
    pub cut_triangles: usize,
    /// Pairs of triangles of the layer itself that cross, before and after.
    pub self_crossings: [usize; 2],
    /// The gap that was asked for, metres; four fifths of it are enough.
    pub gap_m: f32,
    /// Least height of the layer's vertices over any lower layer, metres.
    pub least_gap_m: f32,
    /// Share of its vertices by their height over the nearest lower layer: bins end at [`GAP_BINS_MM`], the last is
    /// further away or over nothing.
    pub gaps: [f32; GAP_BINS_MM.len() + 1],
    /// Mean distance that its vertices moved, metres.
    pub moved_mean_m: f32,
    /// Largest distance that a vertex moved, metres.
    pub moved_max_m: f32,
    /// Mean distance that those vertices moved which the scan saw (attribute `filled` under a half), metres.
    pub moved_seen_mean_m: f32,
    /// The distance that 95 % of those moved less than, metres.
    pub moved_seen_p95_m: f32,
}

/// What stacking did.
#[derive(Debug, Clone, Default, Serialize)]
pub struct StackReport {
    /// By layer, inside to outside.
    pub layers: Vec<LayerReport>,
}

impl LayerReport {
    /// Heights of every vertex of the last surface over the one below that it is nearest to.
    pub(crate) fn read_gaps(&mut self, surfaces: &[WornSurface], settings: &StackSettings) {
        let Some((upper, lowers)) = surfaces.split_last() else { return };
        let least = |p| lowers.iter().filter_map(|l| l.height(p, settings.reach)).fold(f32::INFINITY, f32::min);
        let heights: Vec<f32> = upper.mesh.positions.par_iter().map(least).collect();
        self.least_gap_m = heights.iter().copied().fold(settings.reach, f32::min);
        for h in &heights {
            let bin = GAP_BINS_MM.iter().position(|end| h * 1e3 < *end).unwrap_or(GAP_BINS_MM.len());
            self.gaps[bin] += 1.0 / heights.len() as f32;
        }
    }

    pub(crate) fn read_moves(&mut self, layer: &Mesh, moved: Vec<f32>) {
        let mean = |m: &[f32]| m.iter().sum::<f32>() / m.len().max(1) as f32;
        (self.moved_mean_m, self.moved_max_m) = (mean(&moved), moved.iter().copied().fold(0.0, f32::max));
        let filled = layer.attributes.get("filled");
        let seen = |v: usize| filled.is_none_or(|f| f[v] < 0.5);
        let mut seen: Vec<f32> = (0..moved.len()).filter(|&v| seen(v)).map(|v| moved[v]).collect();
        self.moved_seen_mean_m = mean(&seen);
        seen.sort_by(f32::total_cmp);
        self.moved_seen_p95_m = seen.get(seen.len() * 95 / 100).copied().unwrap_or(0.0);
    }
}
