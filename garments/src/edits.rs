//! Corrections by hand: strokes that say what belongs to the garment, and lines that its hem follows.
//!
//! Edits are data ([`format`](mod@format)), applied again whenever the layer is rebuilt. An edit changes labels only in its
//! neighbourhood: [`GROWTH`] radii around a stroke, the reach of a hem line.

pub mod applied;
pub mod format;
mod line;

use self::{
    applied::{Applied, WithoutEffect},
    format::{EditName, Edits, HemLine, Stroke},
    line::{Line, OnLine},
};
use crate::{
    labels::{
        energy::Energy,
        types::{Labels, Reason},
    },
    measure::{Measured, scan_graph::ScanGraph},
    settings::ExtractSettings,
};

/// Around a stroke, up to this many radii, the border may move to a better place.
pub const GROWTH: f32 = 2.0;
/// Log odds that a stroke adds just beside itself, nats; they fade to 0 at the end of the neighbourhood.
const BESIDE: f32 = 3.0;
/// Log odds of certain labels, nats.
const CERTAIN: f32 = 100.0;

/// The labels with the edits applied to them, and what these did.
pub(crate) fn apply(mut labels: Labels, edits: &Edits, on: &Measured, settings: &ExtractSettings) -> (Labels, Applied) {
    let energy = Energy::new(on, settings);
    let before = labels.garment.clone();
    let mut applied = Applied::new(on.graph.len());
    for (k, stroke) in edits.strokes.iter().enumerate() {
        labels = apply_stroke(labels, stroke, EditName::Stroke(k + 1), on, &energy, &mut applied);
    }
    for (k, hem) in edits.hems.iter().enumerate() {
        labels = apply_hem_line(labels, hem, EditName::HemLine(k + 1), &on.graph, &mut applied);
    }
    let changed = (0..before.len()).filter(|&v| before[v] != labels.garment[v]);
    applied.changed_m2 = changed.map(|v| on.graph.areas[v]).sum();
    (labels, applied)
}

/// Vertices that the stroke touches get its label; around it the border moves to the minimum of the energy.
fn apply_stroke(
    mut labels: Labels,
    stroke: &Stroke,
    name: EditName,
    on: &Measured,
    energy: &Energy,
    applied: &mut Applied,
) -> Labels {
    let line = Line::new(&stroke.points);
    let (sign, radius, far) = (stroke.mark.sign(), stroke.radius, GROWTH * stroke.radius);
    let distance: Vec<f32> = on.graph.positions.iter().map(|p| line.closest(p).distance).collect();
    let nearest = distance.iter().copied().fold(f32::INFINITY, f32::min);
    if nearest > radius {
        applied.without_effect.push(WithoutEffect { edit: name, distance_m: nearest, radius_m: radius });
    }
    let odds = |(v, &d): (usize, &f32)| match d {
        d if d <= radius => sign * CERTAIN,
        d if d < far => labels.log_odds[v] + sign * BESIDE * (far - d) / (far - radius),
        _ => CERTAIN.copysign(if labels.garment[v] { 1.0 } else { -1.0 }),
    };
    let local = energy.minimise(distance.iter().enumerate().map(odds).collect(), &[]);
    for (v, &d) in distance.iter().enumerate().filter(|(_, d)| **d < far) {
        applied.near[v] = true;
        if d <= radius {
            applied.painted[v] = Some(stroke.mark);
            labels.confidence[v] = 1.0;
            labels.reasons[v] = Reason::Stroke;
        } else if labels.garment[v] != local.garment[v] {
            applied.painted[v] = None;
        }
        labels.decide(v, if d <= radius { sign > 0.0 } else { local.garment[v] }, Reason::Stroke);
    }
    labels
}

/// Vertices within reach of the line belong to the garment on that side of it that has more of it already.
fn apply_hem_line(
    mut labels: Labels,
    hem: &HemLine,
    name: EditName,
    graph: &ScanGraph,
    applied: &mut Applied,
) -> Labels {
    let line = Line::new(&hem.points);
    let hits: Vec<OnLine> = graph.positions.iter().map(|p| line.closest(p)).collect();
    let on_hem: Vec<&OnLine> = hem_vertices(&labels, graph).map(|v| &hits[v]).collect();
    if !on_hem.iter().any(|hit| hit.within && hit.distance < hem.reach) {
        let distance_m = on_hem.iter().map(|hit| hit.distance).fold(f32::INFINITY, f32::min);
        applied.without_effect.push(WithoutEffect { edit: name, distance_m, radius_m: hem.reach });
        return labels;
    }
    let side = |(v, hit): (usize, &OnLine)| {
        let side = hit.along.cross(&(graph.positions[v] - hit.point)).dot(&graph.normals[v]);
        (hit.within && hit.distance < hem.reach).then(|| (v, hit.distance.copysign(side)))
    };
    let near: Vec<(usize, f32)> = hits.iter().enumerate().filter_map(side).collect();
    let of_garment = |(v, s): &(usize, f32)| if labels.garment[*v] { graph.areas[*v] * s.signum() } else { 0.0 };
    let garment_side: f32 = near.iter().map(of_garment).sum::<f32>().signum();
    for (v, s) in near {
        let signed = s * garment_side;
        applied.near[v] = true;
        applied.hem_distance[v] = Some(signed);
        applied.painted[v] = None;
        labels.confidence[v] = 1.0;
        labels.decide(v, signed > 0.0, Reason::HemLine);
    }
    labels
}

/// Vertices on either side of the garment's border, and those of the garment on open edges of the scan.
fn hem_vertices<'a>(labels: &'a Labels, graph: &'a ScanGraph) -> impl Iterator<Item = usize> + 'a {
    let differs =
        move |v: usize| graph.neighbors.of(v).iter().any(|&n| labels.garment[n as usize] != labels.garment[v]);
    (0..graph.len()).filter(move |&v| (labels.garment[v] && graph.open[v]) || differs(v))
}
