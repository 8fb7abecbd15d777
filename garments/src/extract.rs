//! One take's garment, from the scan to the common frame.

use serde::Serialize;
use toile_character::{Pose, Skeleton, SkinWeights};
use toile_geometry::{
    Mesh,
    topology::{boundary_loops, loop_length},
};

use crate::{
    ExtractSettings, GarmentError, GarmentType, clean, common_frame,
    edits::Edits,
    evidence::{self, Evidence},
    garment_mesh::{bones, garment_mesh},
    guess::{guess_type, looks_like_two},
    hanging::{FREE_PART, mark_free},
    hem,
    labels::{self, Labels},
    not_new,
    scan_graph::ScanGraph,
};

/// Boundary loops at least this long are openings of the garment, metres; shorter ones are small holes.
const OPENING: f32 = 0.15;
/// Scan this far inside what was worn before means that something is missing, metres.
const SUNKEN: f32 = 0.012;
/// A sunken surface faces as what was worn before does, up to this angle (cosine).
const SUNKEN_FACING: f32 = 0.5;
/// So much sunken area makes a warning, square metres.
const SUNKEN_AREA: f32 = 0.03;
/// Rounds in which steps are taken off at the hem.
const STEP_ROUNDS: usize = 3;
/// Labels less sure than this are marked as unsure.
const UNSURE: f32 = 0.7;

/// What is known of a take before its garment is taken out. All meshes are in the scan's frame.
#[derive(Debug, Clone, Copy)]
pub struct Take<'a> {
    /// The new scan, with colours and the attribute `filled`.
    pub scan: &'a Mesh,
    /// What was worn before (the scan of the take before), posed into this scan, with colours.
    pub previous: &'a Mesh,
    /// The body posed into this scan, on the template's triangles.
    pub body: &'a Mesh,
    /// Skin weights of the body.
    pub weights: &'a SkinWeights,
    /// The body's rest skeleton.
    pub skeleton: &'a Skeleton,
    /// The body's pose in this take, relative to rest.
    pub pose: &'a Pose,
    /// The body's pose in take 0: the common frame.
    pub pose0: &'a Pose,
    /// The garment's type where it was told.
    pub garment_type: Option<GarmentType>,
    /// Corrections by hand.
    pub edits: Option<&'a Edits>,
}

/// What an operator should know about a layer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum Warning {
    /// Nothing new is worn in this take.
    NothingNew,
    /// Scan areas lie well inside what was worn before: something was taken off, or pressed in; square metres.
    TakenOff(f32),
    /// What is new covers torso and each leg by itself, or lies in pieces on different parts of the body.
    TwoAtOnce,
}

impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NothingNew => write!(f, "no new garment was found in this take: was one put on before it?"),
            Self::TakenOff(area) => {
                write!(f, "{:.0} cm² of the scan lie inside what was worn before: was something taken off?", area * 1e4)
            }
            Self::TwoAtOnce => {
                write!(f, "what is new looks like two garments put on at once (or an overall); it is kept as one layer")
            }
        }
    }
}

/// A take's garment and how it was found.
#[derive(Debug, Clone)]
pub struct Extraction {
    /// Labels of the scan's vertices.
    pub labels: Labels,
    /// The garment in the take's pose and frame; attributes `confidence`, `filled`, and for skirts and dresses
    /// [`FREE_PART`]. Empty where nothing new was found.
    pub in_take: Mesh,
    /// The same vertices in the common frame: take 0's pose.
    pub garment: Mesh,
    /// Skin weights of the garment's vertices.
    pub weights: SkinWeights,
    /// What was decided.
    pub report: ExtractionReport,
    /// What to worry about.
    pub warnings: Vec<Warning>,
}

/// What the extraction decided, for the layer's report.
#[derive(Debug, Clone, Serialize)]
pub struct ExtractionReport {
    /// Told or guessed type.
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
}

/// Finds the new garment of a take, cuts it out and brings it to the common frame.
///
/// # Errors
/// [`GarmentError`] where a mesh is empty, broken, or does not go with its weights. A take without a new garment is a
/// result with [`Warning::NothingNew`] and empty meshes.
pub fn extract(
    take: &Take,
    settings: &ExtractSettings,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<Extraction, GarmentError> {
    check(take)?;
    let graph = ScanGraph::new(take.scan);
    let evidence = evidence::measure(take, &graph, settings);
    progress(0.3);
    let (garment_type, mut labels, uncovered) = label(take, &graph, &evidence, settings);
    clean::drop_islands(&graph, &mut labels, settings);
    clean::settle_filled(take.scan, &graph, &evidence, &mut labels, &bones(take));
    take_off_steps(take, &graph, &evidence, &mut labels, garment_type, settings);
    clean::settle_filled(take.scan, &graph, &evidence, &mut labels, &bones(take));
    let pieces = clean::drop_islands(&graph, &mut labels, settings);
    let is_two = looks_like_two(take, &graph, &evidence, &labels);
    progress(0.6);
    let applied = take.edits.map(|e| e.apply(take.scan, &graph, &evidence, &mut labels, settings));
    let mut in_take = garment_mesh(take, &graph, &evidence, &labels, garment_type, applied.as_ref(), settings);
    if matches!(garment_type, GarmentType::Skirt | GarmentType::Dress) && !in_take.is_empty() {
        in_take.attributes.insert(FREE_PART.into(), mark_free(take.body, &in_take));
    }
    progress(0.8);
    let weights = common_frame::weights(take, &in_take, settings);
    let garment = common_frame::to_common_frame(take, &in_take, &weights);
    let mut warnings = warnings(&graph, &evidence, &labels, &in_take, uncovered);
    if is_two {
        warnings.push(Warning::TwoAtOnce);
    }
    let mut report = report(take, &in_take, &evidence, garment_type, pieces);
    report.edited_m2 = applied.map_or(0.0, |a| a.changed_m2);
    progress(1.0);
    Ok(Extraction { labels, in_take, garment, weights, report, warnings })
}

fn check(take: &Take) -> Result<(), GarmentError> {
    for (mesh, name) in [(take.scan, "scan"), (take.previous, "earlier layers' surface"), (take.body, "body")] {
        if mesh.is_empty() {
            return Err(GarmentError::Empty(name));
        }
        mesh.validate().map_err(|e| GarmentError::Mesh(format!("the {name}: {e}")))?;
    }
    let (vertices, weights) = (take.body.positions.len(), take.weights.len());
    if vertices != weights {
        return Err(GarmentError::Mismatch(format!("the body has {vertices} vertices but weights for {weights}")));
    }
    take.edits.map_or(Ok(()), |edits| edits.check().and_then(|()| edits.check_on(take.scan)))
}

/// Labels with the told type's template, or first with none, then with that of the guessed type; and the area of what
/// looked new and was uncovered.
fn label(
    take: &Take,
    graph: &ScanGraph,
    evidence: &Evidence,
    settings: &ExtractSettings,
) -> (GarmentType, Labels, f32) {
    let labelled = |garment_type: GarmentType, earlier: Option<&Labels>| {
        let mut labels = labels::label(graph, evidence, garment_type, earlier, settings);
        let uncovered = not_new::drop_uncovered(graph, evidence, &mut labels);
        not_new::drop_swung(graph, evidence, &mut labels);
        (garment_type, labels, uncovered)
    };
    if let Some(told) = take.garment_type {
        return labelled(told, None);
    }
    let free = labelled(GarmentType::Other, None);
    match guess_type(take, graph, evidence, &free.1) {
        GarmentType::Other => free,
        guess => {
            let (garment_type, labels, uncovered) = labelled(guess, Some(&free.1));
            (garment_type, labels, uncovered.max(free.2))
        }
    }
}

/// Moves the border from the foot of each hem's step half-way up, and on to the fold where a ledge is wider than what is
/// looked at in a round.
fn take_off_steps(
    take: &Take,
    graph: &ScanGraph,
    evidence: &Evidence,
    labels: &mut Labels,
    garment_type: GarmentType,
    settings: &ExtractSettings,
) {
    let colors = labels::color_model(graph, labels);
    let facing = garment_type == GarmentType::Jacket;
    for round in 0..STEP_ROUNDS {
        let before = labels.garment.clone();
        hem::lower_steps(take.scan, graph, evidence, labels, &colors, facing, settings);
        if !(facing && round > 0) {
            // A facing turns in and would be eaten up round by round.
            hem::lower_slopes(take.scan, graph, evidence, labels, &colors, facing, settings);
        }
        labels::relabel(graph, evidence, labels, settings);
        if labels.garment == before {
            break;
        }
    }
}

fn warnings(graph: &ScanGraph, evidence: &Evidence, labels: &Labels, garment: &Mesh, uncovered: f32) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if garment.is_empty() {
        warnings.push(Warning::NothingNew);
    }
    let area = uncovered.max(sunken_area(graph, evidence, labels));
    if area > SUNKEN_AREA {
        warnings.push(Warning::TakenOff(area));
    }
    warnings
}

/// Area that lies well inside what was worn before. New cloth may press in what is below it, and what nobody saw then or
/// now tells nothing.
fn sunken_area(graph: &ScanGraph, evidence: &Evidence, labels: &Labels) -> f32 {
    let sunken = SUNKEN.max(4.0 * evidence.height_noise);
    let seen = |v: usize| graph.filled[v] < 0.5 && (graph.lab.is_empty() || !evidence.color[v].is_nan());
    let inside = |&v: &usize| evidence.height[v] < -sunken && evidence.facing[v] > SUNKEN_FACING;
    let area = |v: usize| graph.areas[v];
    (0..graph.len()).filter(|&v| seen(v) && !labels.garment[v]).filter(inside).map(area).sum()
}

fn report(
    take: &Take,
    garment: &Mesh,
    evidence: &Evidence,
    garment_type: GarmentType,
    pieces: usize,
) -> ExtractionReport {
    let share = |name: &str, holds: &dyn Fn(f32) -> bool| {
        let values = garment.attributes.get(name).map(Vec::as_slice).unwrap_or(&[]);
        values.iter().filter(|&&x| holds(x)).count() as f32 / values.len().max(1) as f32
    };
    let mut openings: Vec<f32> = boundary_loops(&garment.triangles)
        .iter()
        .map(|l| loop_length(&garment.positions, l))
        .filter(|&l| l >= OPENING)
        .collect();
    openings.sort_by(|a, b| b.total_cmp(a));
    ExtractionReport {
        garment_type,
        type_guessed: take.garment_type.is_none(),
        area_m2: garment.area(),
        unsure_share: share("confidence", &|c| c < UNSURE),
        filled_share: share("filled", &|f| f > 0.5),
        openings_m: openings,
        height_noise_m: evidence.height_noise,
        color_noise: evidence.color_noise,
        pieces,
        edited_m2: 0.0,
    }
}
