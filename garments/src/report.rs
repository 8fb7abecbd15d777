//! The decisions of extracting a garment, and its warnings.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use toile_character::GarmentType;
use toile_geometry::{
    Mesh,
    holes::FILLED,
    topology::{boundary_loops, loop_length},
};

use crate::{
    edits::applied::{Applied, WithoutEffect},
    labels::types::{Labels, Reason},
    measure::Measured,
    mesh::draft::CONFIDENCE,
};

/// Boundary loops at least this long are openings of the garment, metres; shorter ones are small holes.
const OPENING: f32 = 0.15;
/// Something is missing where the scan lies this far inside the surface worn before, metres, and at least this many noise
/// scales.
const SUNKEN: f32 = 0.012;
const SUNKEN_NOISE: f32 = 4.0;
/// A sunken surface faces as the surface worn before does, up to this angle (cosine).
const SUNKEN_ALIGNMENT: f32 = 0.5;
/// A larger sunken area makes a warning, square metres.
const SUNKEN_AREA: f32 = 0.03;
/// Labels less sure than this are counted as unsure.
const UNSURE: f32 = 0.7;

/// A warning about a layer, for the operator.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum Warning {
    /// Nothing new is worn in this take.
    NothingNew,
    /// No cloth is worn in a first take that was said to be dressed.
    NoClothes,
    /// Scan areas lie well inside the surface worn before: something was taken off, or pressed in; square metres.
    TakenOff(f32),
    /// The new cloth covers the torso and each leg separately, or lies in pieces on different parts of the body.
    TwoAtOnce,
    /// A correction by hand could not do anything.
    EditWithoutEffect(WithoutEffect),
}

impl Warning {
    /// Whether the take gives no garment.
    pub fn is_empty(&self) -> bool {
        matches!(self, Self::NothingNew | Self::NoClothes)
    }
}

impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NoClothes => {
                write!(f, "no clothes were found in this take: does it show the undressed body after all?")
            }
            Self::NothingNew => write!(f, "no new garment was found in this take: was one put on before it?"),
            Self::TakenOff(area) => {
                write!(f, "{:.0} cm² of the scan lie inside what was worn before: was something taken off?", area * 1e4)
            }
            Self::TwoAtOnce => {
                write!(f, "two garments seem to have been put on at once (or an overall); they are kept as one layer")
            }
            Self::EditWithoutEffect(edit) => edit.fmt(f),
        }
    }
}

/// The decisions of the extraction, for the layer's report.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ExtractionReport {
    /// Known or guessed type.
    pub garment_type: GarmentType,
    /// True where the type was guessed.
    pub type_guessed: bool,
    /// Area of the garment, square metres.
    pub area_m2: f64,
    /// Share of the garment's vertices whose label is unsure.
    pub unsure_share: f32,
    /// Share of the garment's vertices that nobody saw.
    pub filled_share: f32,
    /// Lengths of the openings, longest first, metres.
    pub openings_m: Vec<f32>,
    /// Scale of heights over what was worn before where nothing is new, metres.
    pub height_noise_m: f32,
    /// Scale of colour differences where nothing is new.
    pub color_noise: f32,
    /// Separate pieces, before edits.
    pub pieces: usize,
    /// Area whose label the edits changed, square metres.
    pub edited_m2: f32,
    /// Area of the scan by what decided its label, square metres.
    pub reasons_m2: BTreeMap<Reason, f32>,
}

impl ExtractionReport {
    /// The report of a finished garment.
    pub(crate) fn new(
        on: &Measured,
        labels: &Labels,
        garment: &Mesh,
        garment_type: GarmentType,
        pieces: usize,
        edits: Option<&Applied>,
    ) -> Self {
        let mut reasons_m2 = BTreeMap::new();
        for (reason, area) in labels.reasons.iter().zip(&on.graph.areas) {
            *reasons_m2.entry(*reason).or_default() += area;
        }
        Self {
            garment_type,
            type_guessed: on.take.garment_type.is_none(),
            area_m2: garment.area(),
            unsure_share: share(garment, CONFIDENCE, |c| c < UNSURE),
            filled_share: share(garment, FILLED, |f| f > 0.5),
            openings_m: openings(garment),
            height_noise_m: on.evidence.height_noise,
            color_noise: on.evidence.color_noise,
            pieces,
            edited_m2: edits.map_or(0.0, |edits| edits.changed_m2),
            reasons_m2,
        }
    }
}

/// Share of a mesh's vertices for whose attribute `holds`.
fn share(mesh: &Mesh, name: &str, holds: impl Fn(f32) -> bool) -> f32 {
    let values = mesh.attributes.get(name).map_or(&[][..], Vec::as_slice);
    values.iter().filter(|&&x| holds(x)).count() as f32 / values.len().max(1) as f32
}

/// Lengths of the openings, longest first, metres.
fn openings(garment: &Mesh) -> Vec<f32> {
    let loops = boundary_loops(&garment.triangles);
    let lengths = loops.iter().map(|l| loop_length(&garment.positions, l));
    let mut openings: Vec<f32> = lengths.filter(|&l| l >= OPENING).collect();
    openings.sort_by(|a, b| b.total_cmp(a));
    openings
}

/// Warnings: `uncovered_m2` is the area that looked new and was only uncovered.
pub(crate) fn warnings(
    on: &Measured,
    labels: &Labels,
    garment: &Mesh,
    uncovered_m2: f32,
    is_two: bool,
    edits: Option<&Applied>,
) -> Vec<Warning> {
    let is_first = on.take.is_first;
    // of a body that was guessed, nothing can have been taken off
    let area = if is_first { 0.0 } else { uncovered_m2.max(sunken_area(on, labels)) };
    let mut warnings = Vec::new();
    let nothing = if is_first { Warning::NoClothes } else { Warning::NothingNew };
    warnings.extend(garment.is_empty().then_some(nothing));
    warnings.extend((area > SUNKEN_AREA).then_some(Warning::TakenOff(area)));
    warnings.extend(is_two.then_some(Warning::TwoAtOnce));
    let without_effect = edits.map_or(&[][..], |edits| &edits.without_effect);
    warnings.extend(without_effect.iter().copied().map(Warning::EditWithoutEffect));
    warnings
}

/// Area that lies well inside the surface worn before, square metres. New cloth may press in the surface below it, and
/// places that nobody saw then or now do not count.
fn sunken_area(on: &Measured, labels: &Labels) -> f32 {
    let (graph, evidence) = (&on.graph, &on.evidence);
    let sunken = SUNKEN.max(SUNKEN_NOISE * evidence.height_noise);
    let seen = |v: usize| graph.filled[v] < 0.5 && (graph.lab.is_empty() || !evidence.color[v].is_nan());
    let inside = |&v: &usize| evidence.height[v] < -sunken && evidence.alignment[v] > SUNKEN_ALIGNMENT;
    let area = |v: usize| graph.areas[v];
    (0..graph.len()).filter(|&v| seen(v) && !labels.garment[v]).filter(inside).map(area).sum()
}
