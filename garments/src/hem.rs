//! The hem within the step from the cloth down to what lies below it.
//!
//! A fused scan draws a slope, as wide as a pixel of the camera, from the cloth's edge to the skin below. The colour of
//! that slope is a mixture. The cloth's edge is half-way down: vertices near the border become unlikely where they lie on
//! a step ([`steps`]), low on a slope ([`slopes`]) or past a fold ([`lips`]).

mod border;
mod lips;
mod slopes;
mod steps;

use toile_character::GarmentType;

use self::{border::Border, lips::lip_vertices, slopes::slope_vertices, steps::step_vertices};
use crate::{
    labels::{
        energy::Energy,
        odds::color_model,
        types::{Labels, Reason},
    },
    measure::{Measured, scan_graph::ScanGraph},
    settings::ExtractSettings,
};

/// Rounds in which steps are taken off: each looks as far as `hem_depth`, and ledges can be wider.
const ROUNDS: usize = 3;
/// Log odds of vertices that are not the cloth's own surface, nats.
const NOT_CLOTH: f32 = -2.0;
/// A vertex that has the garment's colour by more than this, nats, lies on its folded rim and not on a step.
const CLOTH_COLOR: f32 = 1.0;
/// A surface that faces up or down more than this (cosine) was not seen by a camera that circles the subject: its colour
/// is carried over from the front of the cloth and says nothing.
const LEVEL: f32 = 0.7;
/// Nearer to the surface worn before than this, metres, the blur of a pixel colours a step.
const LEDGE: f32 = 0.006;

/// The labels with the border moved from the foot of each hem's step half-way up, and on to the fold where a ledge is
/// wider than one round looks.
///
/// Jackets and coats have a facing: an edge turned in behind the fold. Where it was seen, it belongs to the garment.
pub(crate) fn lower_hems(
    mut labels: Labels,
    on: &Measured,
    garment_type: GarmentType,
    settings: &ExtractSettings,
) -> Labels {
    let energy = Energy::new(on, settings);
    let colors = color_model(&on.graph, &labels);
    let has_facing = garment_type == GarmentType::Jacket;
    for round in 0..ROUNDS {
        let before = labels.garment.clone();
        // A facing turns in and would be lost ring by ring.
        labels = lower_once(labels, on, &colors, has_facing, round == 0, settings.hem_depth);
        labels = energy.minimise(labels.log_odds, &labels.reasons);
        if labels.garment == before {
            break;
        }
    }
    labels
}

/// The labels with lowered log odds where, near the border, the surface is not the cloth's own. A vertex that has the
/// garment's colour is not on a step, except on ledges of garments without a facing.
fn lower_once(labels: Labels, on: &Measured, colors: &[f32], has_facing: bool, is_first: bool, depth: f32) -> Labels {
    let border = Border::new(on, &labels.garment, depth);
    let is_cloth = |v: usize| colors[v] > CLOTH_COLOR;
    let is_ledge = |v: usize| !has_facing && level(&on.graph, v) && on.evidence.clearance[v] > LEDGE;
    let steps = step_vertices(&border, |v| is_cloth(v) && !is_ledge(v));
    if has_facing && !is_first {
        return labels.lowered(&steps, NOT_CLOTH, Reason::Step);
    }
    let slopes = slope_vertices(&border);
    let seen = |v: usize| on.graph.filled[v] < 0.5 && !level(&on.graph, v);
    let turned_in = |v: usize| has_facing && is_cloth(v) && seen(v);
    let lips: Vec<u32> = lip_vertices(&border).into_iter().filter(|v| !turned_in(*v as usize)).collect();
    let labels = labels.lowered(&steps, NOT_CLOTH, Reason::Step);
    labels.lowered(&slopes, NOT_CLOTH, Reason::Slope).lowered(&lips, NOT_CLOTH, Reason::Lip)
}

fn level(graph: &ScanGraph, v: usize) -> bool {
    graph.normals[v].y.abs() > LEVEL
}
