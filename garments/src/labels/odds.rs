//! Log odds of "new" at each vertex: what was measured, the type's template, and the colours of an earlier round.

use toile_character::GarmentType;

use super::{bare, template, types::Labels};
use crate::measure::{Measured, color::Histogram, scan_graph::ScanGraph};

/// Where nothing was seen, evidence counts this much.
const FILLED_TRUST: f32 = 0.2;
/// Limit of what the colour model of an earlier round may say, nats.
const COLOR_MODEL_LIMIT: f32 = 2.0;
/// Cloth stands off what was worn before by more than this many noise scales.
const STANDS_OFF: f32 = 3.0;
/// Limit of the sum, nats.
const LIMIT: f32 = 7.0;

/// Log odds for a garment of a type. The colours of `earlier` labels are used where there are any (Rother et al. 2004,
/// GrabCut, on a surface).
pub(super) fn log_odds(on: &Measured, garment_type: GarmentType, earlier: Option<&Labels>) -> Vec<f32> {
    if on.take.is_first {
        return bare::log_odds(on, earlier);
    }
    let (graph, evidence) = (&on.graph, &on.evidence);
    let prior = template::log_odds(garment_type);
    let colors = earlier.map_or_else(|| vec![0.0; graph.len()], |l| color_model(graph, l));
    let shares = earlier.map_or_else(|| vec![0.0; graph.len()], |l| color_shares(on, l));
    let at = |v: usize| {
        let place: f32 = evidence.parts[v].iter().zip(&prior).map(|(share, p)| share * p).sum();
        let trust = if graph.filled[v] > 0.5 { FILLED_TRUST } else { 1.0 };
        (trust * (evidence.log_odds(v, shares[v]) + colors[v]) + place).clamp(-LIMIT, LIMIT)
    };
    (0..graph.len()).map(at).collect()
}

/// Log odds of each vertex's colour by the colours of the garment and of the rest in `labels`, weighted by confidence.
pub(crate) fn color_model(graph: &ScanGraph, labels: &Labels) -> Vec<f32> {
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

/// The share of the garment in `labels` that has the colour of each vertex. Only what stands off the surface worn before
/// counts: what lies inside it is no cloth that was put on, whatever these labels say.
fn color_shares(on: &Measured, labels: &Labels) -> Vec<f32> {
    let graph = &on.graph;
    let stands_off = STANDS_OFF * on.evidence.height_noise;
    let mut cloth = Histogram::default();
    let counts = |&v: &usize| labels.garment[v] && graph.filled[v] < 0.5 && on.evidence.height[v] > stands_off;
    for v in (0..graph.lab.len()).filter(counts) {
        cloth.add(&graph.lab[v], graph.areas[v] * labels.confidence[v]);
    }
    (0..graph.len()).map(|v| graph.lab.get(v).map_or(0.0, |c| cloth.share(c))).collect()
}
