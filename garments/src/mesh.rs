//! The garment's own mesh: the scan cut along the border of its labels, made whole and remeshed.

mod crumples;
mod cut;
pub mod draft;
mod extend;
mod fill;
mod pieces;
mod rim;
pub(crate) mod untangle;

use toile_character::GarmentType;
use toile_geometry::{Mesh, handles, remesh};

use self::{
    crumples::cut_crumpled,
    cut::{cut_positive, smooth_field},
    draft::{Channel, Channels, Draft},
    extend::extend,
    fill::{close_hidden, fill_holes},
    pieces::{drop_strips, keep_large_pieces},
};
use crate::{
    edits::{applied::Applied, format::Mark},
    labels::types::Labels,
    measure::{Measured, scan_graph::ScanGraph},
    settings::ExtractSettings,
};

/// Rims with more than this share of [`Channel::Unseen`] are free edges.
const FREE_SHARE: f32 = 0.25;
/// Rims further than this from what was worn before stand above a ledge, metres. Their cloth is seen except for half of
/// the last pixel, a third of what a free edge loses.
const ABOVE_LEDGE: f32 = 0.02;
const LEDGE_LOSS: f32 = 1.0 / 3.0;
/// Rims with fewer vertices are small holes, and left as they are.
const FEWEST_RIM_VERTICES: usize = 20;
/// Triangles that cross this near to a rim, and cannot be smoothed apart, are cut away, metres.
const CRUMPLED: f32 = 0.04;
/// Rounds of that.
const CRUMPLED_ROUNDS: usize = 4;
/// Rounds in which "unseen" spreads to the neighbours.
const UNSEEN_ROUNDS: usize = 2;

/// The garment's own mesh: cut along the smoothed border, islands dropped, holes closed, remeshed. Empty where there is
/// no garment.
pub(crate) fn garment_mesh(
    labels: &Labels,
    on: &Measured,
    garment_type: GarmentType,
    edits: Option<&Applied>,
    settings: &ExtractSettings,
) -> Mesh {
    if !labels.garment.contains(&true) {
        return Mesh::default();
    }
    let mut draft =
        Draft { surface: bare(on.take.scan), channels: channels(labels, on, garment_type, edits, settings) };
    close_hidden(&mut draft, &labels.garment, &on.bones);
    draft = cut_positive(draft, &field(labels, &on.graph, edits, settings));
    draft = keep_large_pieces(&draft, settings.piece_share);
    fill_holes(&mut draft, &on.bones, settings.hole_rim);
    draft = draft.through(|mesh| handles::cut_handles(mesh, settings.hole_rim).0);
    let lost = lost_at_rims(&draft, settings);
    extend(&mut draft, &lost);
    draft = draft.through(|mesh| remesh::isotropic(mesh, settings.edge_length));
    draft = keep_large_pieces(&drop_strips(&draft), settings.piece_share);
    rim::smooth(&mut draft.surface, settings.rim_smoothing, FEWEST_RIM_VERTICES);
    uncrumple(draft, on, settings).finished()
}

/// The part of `mesh` where `field`, one value a vertex, is positive; triangles that its zero line crosses are split.
pub(crate) fn part_where_positive(mesh: &Mesh, field: &[f32]) -> Mesh {
    cut_positive(Draft::of(mesh), field).surface
}

/// `mesh` with places that cross themselves smoothed apart, as far as that goes.
pub(crate) fn untangled(mut mesh: Mesh) -> Mesh {
    untangle::untangle(&mut mesh);
    mesh
}

/// The draft without places that cross themselves: smoothed apart, or cut away near rims.
fn uncrumple(mut draft: Draft, on: &Measured, settings: &ExtractSettings) -> Draft {
    for _ in 0..CRUMPLED_ROUNDS {
        if untangle::untangle(&mut draft.surface) == 0 || !cut_crumpled(&mut draft, CRUMPLED) {
            break;
        }
        draft = keep_large_pieces(&draft, settings.piece_share);
        fill_holes(&mut draft, &on.bones, settings.hole_rim);
        rim::smooth(&mut draft.surface, settings.rim_smoothing, FEWEST_RIM_VERTICES);
    }
    draft
}

/// The scan's positions, triangles and colours.
fn bare(scan: &Mesh) -> Mesh {
    Mesh { colors: scan.colors.clone(), ..Mesh::new(scan.positions.clone(), scan.triangles.clone()) }
}

/// Values that the mesh carries along from the scan.
fn channels(
    labels: &Labels,
    on: &Measured,
    garment_type: GarmentType,
    edits: Option<&Applied>,
    settings: &ExtractSettings,
) -> Channels {
    // The turned-in edge of a jacket or coat lies behind its fold: nothing is lost there.
    let has_facing = garment_type == GarmentType::Jacket;
    let clearance = |c: &f32| if has_facing { 0.0 } else { c.min(settings.reach) };
    let mut channels = Channels::zero(on.graph.len());
    channels[Channel::Filled].clone_from(&on.graph.filled);
    channels[Channel::Confidence].clone_from(&labels.confidence);
    channels[Channel::Unseen] = unseen_around(&on.graph);
    channels[Channel::Clearance] = on.evidence.clearance.iter().map(clearance).collect();
    if let Some(edits) = edits {
        channels[Channel::ByHand] = by_hand(&on.graph, edits);
        // An edited rim stays where it was put.
        for v in (0..edits.near.len()).filter(|&v| edits.near[v]) {
            (channels[Channel::Unseen][v], channels[Channel::Clearance][v]) = (0.0, 0.0);
        }
    }
    channels
}

/// The field whose zero line is the border: the smoothed labels, except that it runs around strokes and along hem lines.
fn field(labels: &Labels, graph: &ScanGraph, edits: Option<&Applied>, settings: &ExtractSettings) -> Vec<f32> {
    let mut field = smooth_field(graph, &labels.garment, settings.hem_smoothing);
    let Some(edits) = edits else { return field };
    for (v, f) in field.iter_mut().enumerate() {
        *f = match (edits.hem_distance[v], edits.painted[v]) {
            (Some(distance), _) => (distance / settings.hem_smoothing.max(1e-4)).clamp(-1.0, 1.0),
            (None, Some(mark)) => mark.sign(),
            (None, None) => *f,
        };
    }
    field
}

/// The decisions of strokes, with a ring around what they took out: the rim that is left.
fn by_hand(graph: &ScanGraph, edits: &Applied) -> Vec<f32> {
    let is_beside_cut = |v: usize| {
        let taken = Some(Mark::DoesNotBelong);
        graph.neighbors.of(v).iter().any(|&n| edits.painted[n as usize] == taken)
    };
    let said = |(v, mark): (usize, &Option<Mark>)| match mark {
        Some(mark) => mark.sign(),
        None if is_beside_cut(v) => Mark::DoesNotBelong.sign(),
        None => 0.0,
    };
    edits.painted.iter().enumerate().map(said).collect()
}

/// How much cloth the scan lacks beyond each vertex, were it on a rim, metres.
fn lost_at_rims(draft: &Draft, settings: &ExtractSettings) -> Vec<f32> {
    let lost = |(&unseen, &clearance): (&f32, &f32)| match () {
        () if unseen > FREE_SHARE => settings.edge_loss,
        () if clearance > ABOVE_LEDGE => LEDGE_LOSS * settings.edge_loss,
        () => 0.0,
    };
    draft.channels[Channel::Unseen].iter().zip(&draft.channels[Channel::Clearance]).map(lost).collect()
}

/// 1 where the scan ends or was closed without being seen, less around it.
fn unseen_around(graph: &ScanGraph) -> Vec<f32> {
    let mut unseen: Vec<f32> = (0..graph.len()).map(|v| if graph.open[v] { 1.0 } else { graph.filled[v] }).collect();
    for _ in 0..UNSEEN_ROUNDS {
        unseen = (0..graph.len())
            .map(|v| {
                let around = graph.neighbors.of(v);
                let mean = around.iter().map(|&n| unseen[n as usize]).sum::<f32>() / around.len().max(1) as f32;
                unseen[v].max(mean)
            })
            .collect();
    }
    unseen
}
