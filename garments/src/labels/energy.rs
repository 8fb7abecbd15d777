//! One energy over the scan's surface, minimised globally by a graph cut.
//!
//! E(l) = Σ_v area_v · odds_v(l_v) + λ Σ_e dual_e · edge_e · [l_i ≠ l_j]

use toile_geometry::max_flow::GraphCut;

use super::types::{Labels, Reason};
use crate::{
    measure::{Measured, color, evidence::Evidence, scan_graph::ScanGraph},
    settings::ExtractSettings,
};

/// Capacities are integers: one unit is this many square metres times nats.
const UNIT: f32 = 1e-9;
/// A hem along the strongest edge still costs this share.
const MIN_EDGE: f32 = 0.12;
/// Rounds of averaging log odds over the neighbourhood for the confidence of labels.
const CONFIDENCE_ROUNDS: usize = 3;

/// The energy of a scan's labels.
pub(crate) struct Energy<'a> {
    graph: &'a ScanGraph,
    /// Cost of a border through each edge, square metres times nats.
    edge_costs: Vec<f32>,
}

impl<'a> Energy<'a> {
    pub(crate) fn new(on: &'a Measured, settings: &ExtractSettings) -> Self {
        Self { graph: &on.graph, edge_costs: edge_costs(&on.graph, &on.evidence, settings.smoothness) }
    }

    /// The labels of minimum energy for some `log_odds`. `reasons` are those that the vertices had before; they are empty
    /// for first labels.
    pub(crate) fn minimise(&self, log_odds: Vec<f32>, reasons: &[Reason]) -> Labels {
        let units = |x: f32| (x / UNIT).round() as i64;
        let mut cut = GraphCut::new(self.graph.len(), self.graph.edges.len());
        for ((v, &o), area) in (0u32..).zip(&log_odds).zip(&self.graph.areas) {
            let cost = units(o * area);
            cut.add_terminal(v, cost.max(0), (-cost).max(0));
        }
        for (&[a, b], &cost) in self.graph.edges.iter().zip(&self.edge_costs) {
            let cost = units(cost);
            cut.add_edge(a, b, cost, cost);
        }
        cut.solve();
        let garment: Vec<bool> = (0..self.graph.len() as u32).map(|v| cut.is_source(v)).collect();
        let reason = |v: usize| {
            let before = reasons.get(v).copied().unwrap_or_default();
            before.after_minimising(garment[v] == (log_odds[v] > 0.0))
        };
        let reasons = (0..garment.len()).map(reason).collect();
        Labels { confidence: confidence(self.graph, &log_odds, &garment), garment, reasons, log_odds }
    }
}

/// Cost of a border through each edge: its dual length, less where colour or height jumps.
fn edge_costs(graph: &ScanGraph, evidence: &Evidence, smoothness: f32) -> Vec<f32> {
    let jumps: Vec<[f32; 2]> = graph.edges.iter().map(|e| jump(graph, evidence, e.map(|v| v as usize))).collect();
    let count = graph.edges.len().max(1) as f64;
    let mean = |k: usize| jumps.iter().fold(0.0f64, |sum, jump| sum + f64::from(jump[k]) / count) as f32;
    let color_scale = 1.0 / (4.0 * mean(0)).max(1e-6);
    let height_scale = 1.0 / (4.0 * mean(1).max(evidence.height_noise.powi(2)));
    let cost = |(&[color, height], dual): (&[f32; 2], &f32)| {
        let edge = (-(color * color_scale + height * height_scale)).exp();
        smoothness * dual * (MIN_EDGE + (1.0 - MIN_EDGE) * edge)
    };
    jumps.iter().zip(&graph.dual_lengths).map(cost).collect()
}

/// Squared differences of colour and height between two vertices.
fn jump(graph: &ScanGraph, evidence: &Evidence, [i, j]: [usize; 2]) -> [f32; 2] {
    let color = if graph.lab.is_empty() { 0.0 } else { color::difference(&graph.lab[i], &graph.lab[j]).powi(2) };
    let (hi, hj) = (evidence.height[i], evidence.height[j]);
    [color, if hi.is_finite() && hj.is_finite() { (hi - hj).powi(2) } else { 0.0 }]
}

/// Probability of each label from the log odds averaged over the neighbourhood.
fn confidence(graph: &ScanGraph, odds: &[f32], garment: &[bool]) -> Vec<f32> {
    let mut mean = odds.to_vec();
    for _ in 0..CONFIDENCE_ROUNDS {
        mean = (0..mean.len())
            .map(|v| {
                let around = graph.neighbors.of(v);
                let sum: f32 = around.iter().map(|&n| mean[n as usize]).sum();
                (mean[v] + sum) / (1.0 + around.len() as f32)
            })
            .collect();
    }
    mean.iter().zip(garment).map(|(&m, &g)| (1.0 / (1.0 + (if g { -m } else { m }).exp())).max(0.5)).collect()
}
