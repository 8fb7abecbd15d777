//! New garment or not: one energy over the scan's surface, minimised globally by a graph cut.
//!
//! E(l) = Σ_v area_v · odds_v(l_v) + λ Σ_e dual_e · edge_e · [l_i ≠ l_j]; the odds join height, colour, the type's
//! template and the colours that an earlier round found (Rother et al. 2004, GrabCut, on a surface).

use toile_geometry::max_flow::GraphCut;

use crate::{ExtractSettings, GarmentType, color, color::Histogram, evidence::Evidence, scan_graph::ScanGraph};

/// Capacities are integers: one unit is this many square metres times nats.
const UNIT: f32 = 1e-9;
/// Hem along the strongest edge still costs this share.
const LEAST_EDGE: f32 = 0.12;
/// Where nothing was seen, evidence counts this much.
const FILLED_TRUST: f32 = 0.2;
/// What the colour model of an earlier round may say at most, nats.
const COLOR_MODEL_LIMIT: f32 = 2.0;

/// The answer for each scan vertex.
#[derive(Debug, Clone, Default)]
pub struct Labels {
    /// True where the new garment is.
    pub garment: Vec<bool>,
    /// How sure the label is, 0.5 to 1.
    pub confidence: Vec<f32>,
    /// Log odds that the last round used, before smoothing.
    pub log_odds: Vec<f32>,
}

/// Labels a scan. `initial` holds the labels of an earlier call, whose colours are used from the first round on.
pub fn label(
    graph: &ScanGraph,
    evidence: &Evidence,
    garment_type: GarmentType,
    initial: Option<&Labels>,
    settings: &ExtractSettings,
) -> Labels {
    let edge_costs = edge_costs(graph, evidence, settings.smoothness);
    let mut labels = initial.cloned();
    for _ in 0..settings.rounds.max(1) {
        let odds = odds(graph, evidence, garment_type, labels.as_ref());
        let garment = cut(graph, &odds, &edge_costs);
        let settled = labels.as_ref().is_some_and(|l| l.garment == garment);
        let confidence = confidence(graph, &odds, &garment);
        labels = Some(Labels { garment, confidence, log_odds: odds });
        if settled {
            break;
        }
    }
    labels.unwrap_or_default()
}

/// Labels once more after the log odds were changed in places.
pub fn relabel(graph: &ScanGraph, evidence: &Evidence, labels: &mut Labels, settings: &ExtractSettings) {
    let edge_costs = edge_costs(graph, evidence, settings.smoothness);
    labels.garment = cut(graph, &labels.log_odds, &edge_costs);
    labels.confidence = confidence(graph, &labels.log_odds, &labels.garment);
}

fn odds(graph: &ScanGraph, evidence: &Evidence, garment_type: GarmentType, earlier: Option<&Labels>) -> Vec<f32> {
    let prior = garment_type.prior();
    let colors = earlier.map(|l| color_model(graph, l)).unwrap_or_else(|| vec![0.0; graph.len()]);
    (0..graph.len())
        .map(|v| {
            let place: f32 = evidence.parts[v].iter().zip(&prior).map(|(share, p)| share * p).sum();
            let trust = if graph.filled[v] > 0.5 { FILLED_TRUST } else { 1.0 };
            (trust * (evidence.log_odds(v) + colors[v]) + place).clamp(-7.0, 7.0)
        })
        .collect()
}

/// Log odds from the colours of garment and rest in `labels`, where the labels are sure.
pub fn color_model(graph: &ScanGraph, labels: &Labels) -> Vec<f32> {
    if graph.lab.is_empty() {
        return vec![0.0; graph.len()];
    }
    let (mut new, mut old) = (Histogram::default(), Histogram::default());
    for v in (0..graph.len()).filter(|&v| graph.filled[v] < 0.5) {
        let side = if labels.garment[v] { &mut new } else { &mut old };
        side.add(&graph.lab[v], graph.areas[v] * labels.confidence[v]);
    }
    let limit = COLOR_MODEL_LIMIT;
    graph.lab.iter().map(|c| (new.density(c) / old.density(c)).ln().clamp(-limit, limit)).collect()
}

/// Cost of cutting each edge: its dual length, less where colour or height jumps.
fn edge_costs(graph: &ScanGraph, evidence: &Evidence, smoothness: f32) -> Vec<f32> {
    let jump = |e: usize| {
        let [i, j] = graph.edges[e].map(|v| v as usize);
        let color = if graph.lab.is_empty() { 0.0 } else { color::difference(&graph.lab[i], &graph.lab[j]).powi(2) };
        let (hi, hj) = (evidence.height[i], evidence.height[j]);
        let height = if hi.is_finite() && hj.is_finite() { (hi - hj).powi(2) } else { 0.0 };
        (color, height)
    };
    let count = graph.edges.len().max(1) as f64;
    let (mut mean_color, mut mean_height) = (0.0f64, 0.0f64);
    for e in 0..graph.edges.len() {
        let (c, h) = jump(e);
        mean_color += f64::from(c) / count;
        mean_height += f64::from(h) / count;
    }
    let color_scale = 1.0 / (4.0 * mean_color as f32).max(1e-6);
    let height_scale = 1.0 / (4.0 * (mean_height as f32).max(evidence.height_noise.powi(2)));
    (0..graph.edges.len())
        .map(|e| {
            let (c, h) = jump(e);
            let edge = (-(c * color_scale + h * height_scale)).exp();
            smoothness * graph.dual_lengths[e] * (LEAST_EDGE + (1.0 - LEAST_EDGE) * edge)
        })
        .collect()
}

fn cut(graph: &ScanGraph, odds: &[f32], edge_costs: &[f32]) -> Vec<bool> {
    let units = |x: f32| (x / UNIT).round() as i64;
    let mut cut = GraphCut::new(graph.len(), graph.edges.len());
    for (v, &o) in odds.iter().enumerate() {
        let cost = units(o * graph.areas[v]);
        cut.add_terminal(v as u32, cost.max(0), (-cost).max(0));
    }
    for (&[a, b], &cost) in graph.edges.iter().zip(edge_costs) {
        let cost = units(cost);
        cut.add_edge(a, b, cost, cost);
    }
    cut.solve();
    (0..graph.len() as u32).map(|v| cut.is_source(v)).collect()
}

/// Probability of each label from the log odds averaged over the neighbourhood.
fn confidence(graph: &ScanGraph, odds: &[f32], garment: &[bool]) -> Vec<f32> {
    let mut mean = odds.to_vec();
    for _ in 0..3 {
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
