//! The garment's own mesh: the scan cut along the border of its labels, made whole and remeshed.

use nalgebra::Point3;
use toile_character::joint::JOINTS;
use toile_geometry::{Mesh, handles, remesh};

use crate::{
    ExtractSettings, GarmentType, clean, cut, edits::Applied, evidence::Evidence, extract::Take, labels::Labels, rim,
    scan_graph::ScanGraph, untangle,
};

/// Attribute of the scan that tells where nothing was seen beyond; rims with more than this share of it are free edges.
const FREE: &str = "unseen_around";
const FREE_SHARE: f32 = 0.25;
/// Attribute of the scan: distance from what was worn before, metres; rims further from it stand above a ledge. Their cloth
/// is seen but for half of the last pixel, a third of what a free edge loses.
const CLEARANCE: &str = "clearance";
const ABOVE_LEDGE: f32 = 0.02;
const LEDGE_LOSS: f32 = 1.0 / 3.0;
/// Rims with fewer vertices are small holes, and left as they are.
const LEAST_RIM: usize = 20;
/// What crosses itself this near to a rim, and cannot be smoothed apart, is cut away, metres.
const CRUMPLED: f32 = 0.04;
/// Rounds of that.
const CRUMPLED_ROUNDS: usize = 4;

/// The garment's own mesh: cut along the smoothed border, islands dropped, holes closed, remeshed.
pub(crate) fn garment_mesh(
    take: &Take,
    graph: &ScanGraph,
    evidence: &Evidence,
    labels: &Labels,
    garment_type: GarmentType,
    edits: Option<&Applied>,
    settings: &ExtractSettings,
) -> Mesh {
    if !labels.garment.contains(&true) {
        return Mesh::default();
    }
    let mut field = cut::smooth_field(graph, &take.scan.positions, &labels.garment, settings.hem_smoothing);
    let mut unseen = unseen_around(graph, take.scan);
    // The turned-in edge of a jacket or coat lies behind its fold: nothing is lost there.
    let has_facing = garment_type == GarmentType::Jacket;
    let clear = |c: &f32| if has_facing { 0.0 } else { c.min(settings.reach) };
    let mut clearance: Vec<f32> = evidence.clearance.iter().map(clear).collect();
    if let Some(edits) = edits {
        follow_edits(edits, &mut field, [&mut unseen, &mut clearance], settings.hem_smoothing);
    }
    let by_hand = edits.map(|edits| around_strokes(graph, edits));
    let mut scan = take.scan.clone();
    scan.normals.clear();
    scan.attributes.retain(|name, _| name == "filled");
    scan.attributes.entry("filled".into()).or_insert_with(|| vec![0.0; graph.len()]);
    scan.attributes.insert("confidence".into(), labels.confidence.clone());
    scan.attributes.insert(FREE.into(), unseen);
    scan.attributes.insert(CLEARANCE.into(), clearance);
    scan.attributes.extend(by_hand.map(|said| (clean::BY_HAND.into(), said)));
    let bones = bones(take);
    clean::close_hidden(&mut scan, &labels.garment, &bones);
    let mut mesh = cut::cut_positive(&scan, &field);
    mesh = clean::keep_large_pieces(&mesh, settings.piece_share);
    clean::fill_holes(&mut mesh, &bones, settings.hole_rim);
    mesh = handles::cut_handles(&mesh, settings.hole_rim).0;
    let lost = lost_at_rims(&mut mesh, settings);
    rim::extend(&mut mesh, &lost);
    mesh = remesh::isotropic(&mesh, settings.edge_length);
    mesh = clean::keep_large_pieces(&clean::drop_strips(&mesh), settings.piece_share);
    rim::smooth(&mut mesh, settings.rim_smoothing, LEAST_RIM);
    for _ in 0..CRUMPLED_ROUNDS {
        if untangle::untangle(&mut mesh) == 0 || !clean::cut_crumpled(&mut mesh, CRUMPLED) {
            break;
        }
        mesh = clean::keep_large_pieces(&mesh, settings.piece_share);
        clean::fill_holes(&mut mesh, &bones, settings.hole_rim);
        rim::smooth(&mut mesh, settings.rim_smoothing, LEAST_RIM);
    }
    mesh.attributes.remove(clean::BY_HAND);
    mesh.recompute_normals();
    mesh
}

/// What strokes decided, [`clean::BY_HAND`], with a ring around what they took out: the rim that is left.
fn around_strokes(graph: &ScanGraph, edits: &Applied) -> Vec<f32> {
    let said = |v: usize| {
        let is_beside = || graph.neighbors.of(v).iter().any(|&n| edits.painted[n as usize] < 0.0);
        if edits.painted[v] == 0.0 && is_beside() { -1.0 } else { edits.painted[v] }
    };
    (0..graph.len()).map(said).collect()
}

/// The field's zero line runs around strokes and along hem lines; an edited rim stays where it was put.
fn follow_edits(edits: &Applied, field: &mut [f32], lost: [&mut [f32]; 2], smoothing: f32) {
    field.iter_mut().zip(&edits.painted).filter(|(_, said)| **said != 0.0).for_each(|(f, said)| *f = *said);
    for (f, d) in field.iter_mut().zip(&edits.hem_distance).filter(|(_, d)| d.is_finite()) {
        *f = (d / smoothing.max(1e-4)).clamp(-1.0, 1.0);
    }
    for values in lost {
        values.iter_mut().zip(&edits.near).filter(|(_, near)| **near).for_each(|(x, _)| *x = 0.0);
    }
}

/// How much cloth the scan lacks beyond each vertex, were it on a rim, metres. Takes the attributes that tell it.
fn lost_at_rims(mesh: &mut Mesh, settings: &ExtractSettings) -> Vec<f32> {
    let mut taken = |name: &str| mesh.attributes.remove(name).unwrap_or_default();
    let (unseen, clearance) = (taken(FREE), taken(CLEARANCE));
    let lost = |(&unseen, &clearance): (&f32, &f32)| match () {
        () if unseen > FREE_SHARE => settings.edge_loss,
        () if clearance > ABOVE_LEDGE => LEDGE_LOSS * settings.edge_loss,
        () => 0.0,
    };
    unseen.iter().zip(&clearance).map(lost).collect()
}

/// 1 where the scan ends or was closed without being seen, less around it.
fn unseen_around(graph: &ScanGraph, scan: &Mesh) -> Vec<f32> {
    let open = graph.open_vertices(scan);
    let mut unseen: Vec<f32> = (0..graph.len()).map(|v| if open[v] { 1.0 } else { graph.filled[v] }).collect();
    for _ in 0..2 {
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

/// Segments from each joint to its parent.
pub(crate) fn bones(take: &Take) -> Vec<[Point3<f32>; 2]> {
    let at = take.pose.joint_positions(take.skeleton);
    JOINTS.iter().filter_map(|j| Some([at[j.parent()?.index()].cast::<f32>(), at[j.index()].cast::<f32>()])).collect()
}
