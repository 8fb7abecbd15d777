//! One take's garment, from the scan to the common frame.

use nalgebra::{Point3, Vector3};
use serde::Serialize;
use toile_character::{Joint, Pose, Skeleton, SkinWeights, joint::JOINTS};
use toile_geometry::{
    Mesh,
    bvh::Bvh,
    handles, remesh,
    topology::{boundary_loops, loop_length},
};

use crate::{
    ExtractSettings, GarmentError, GarmentType,
    body_parts::{BodyPart, PART_COUNT, part_of},
    clean, common_frame, cut,
    edits::{Applied, Edits},
    evidence::{self, Evidence},
    hanging::{FREE_PART, mark_free},
    hem,
    labels::{self, Labels},
    not_new, rim,
    scan_graph::ScanGraph,
    untangle,
};

/// Boundary loops at least this long are openings of the garment, metres; shorter ones are small holes.
const OPENING: f32 = 0.15;
/// Scan this far inside what was worn before means that something is missing, metres.
const SUNKEN: f32 = 0.012;
/// A sunken surface faces as what was worn before does, up to this angle (cosine).
const SUNKEN_FACING: f32 = 0.5;
/// So much sunken area makes a warning, square metres.
const SUNKEN_AREA: f32 = 0.03;
/// Cloth this near to the inner thigh follows it, metres.
const FOLLOWS: f32 = 0.06;
/// New cloth on this share of the inner thighs goes around each leg by itself.
pub(crate) const LEGS_APART: f32 = 0.2;
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
    /// Separate pieces.
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
    if looks_like_two(take, &graph, &evidence, &labels) {
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
        guess => labelled(guess, Some(&free.1)),
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

/// Type from what is covered, what follows the inner thighs and whether the front is open.
fn guess_type(take: &Take, graph: &ScanGraph, evidence: &Evidence, labels: &Labels) -> GarmentType {
    let shares = covered_shares(graph, evidence, |v| labels.garment[v]);
    GarmentType::guess(&shares, inner_thighs(take, labels), front_is_open(take, labels))
}

/// Share of each body part's scanned area for which `new` holds.
fn covered_shares(graph: &ScanGraph, evidence: &Evidence, new: impl Fn(usize) -> bool) -> [f32; PART_COUNT] {
    let (mut covered, mut all) = ([0.0f32; PART_COUNT], [1e-6f32; PART_COUNT]);
    for v in 0..graph.len() {
        for (k, share) in evidence.parts[v].iter().enumerate() {
            all[k] += share * graph.areas[v];
            covered[k] += if new(v) { share * graph.areas[v] } else { 0.0 };
        }
    }
    std::array::from_fn(|k| covered[k] / all[k])
}

/// True where one piece covers torso and each leg by itself, or where large pieces cover different parts: a pair of
/// socks covers the same parts twice, a shirt and a skirt do not.
fn looks_like_two(take: &Take, graph: &ScanGraph, evidence: &Evidence, labels: &Labels) -> bool {
    let covers = |shares: &[f32; PART_COUNT], part: BodyPart| shares[part as usize] > 0.35;
    let all = covered_shares(graph, evidence, |v| labels.garment[v]);
    let jumpsuit = covers(&all, BodyPart::Torso) && inner_thighs(take, labels) > LEGS_APART;
    let (piece, areas) = graph.components(|v| labels.garment[v]);
    let main = |k: usize| {
        let shares = covered_shares(graph, evidence, |v| piece[v] == k as u32);
        (0..PART_COUNT).max_by(|&a, &b| shares[a].total_cmp(&shares[b]))
    };
    let pieces: Vec<_> = (0..areas.len()).map(main).collect();
    jumpsuit || pieces.windows(2).any(|p| p[0] != p[1])
}

/// Share of the inner thighs that new cloth follows: trousers do, a skirt hangs around both legs.
fn inner_thighs(take: &Take, labels: &Labels) -> f32 {
    let joints = take.pose.joint_positions(take.skeleton);
    let across = joints[Joint::RightUpperLeg.index()] - joints[Joint::LeftUpperLeg.index()];
    let across = across.cast::<f32>().try_normalize(1e-6).unwrap_or(-Vector3::x());
    let bvh = Bvh::new(&take.scan.positions, &take.scan.triangles);
    let normals = take.scan.triangle_normals();
    let body_normals = take.body.vertex_normals();
    let (mut followed, mut inner) = (0, 0);
    for (v, n) in body_normals.iter().enumerate() {
        let side = match JOINTS.get(take.weights.joints[v][0] as usize) {
            Some(Joint::LeftUpperLeg) => 1.0,
            Some(Joint::RightUpperLeg) => -1.0,
            _ => continue,
        };
        if n.dot(&across) * side > 0.8 {
            inner += 1;
            let hit = bvh.ray(&take.body.positions[v], n, FOLLOWS).filter(|h| {
                let new = labels.garment[take.scan.triangles[h.triangle as usize][0] as usize];
                new && normals[h.triangle as usize].dot(n) > 0.0
            });
            followed += usize::from(hit.is_some());
        }
    }
    followed as f32 / inner.max(1) as f32
}

/// True where the middle of the back is covered much more than the middle of the front.
fn front_is_open(take: &Take, labels: &Labels) -> bool {
    let frame = take.pose.joint_frames(take.skeleton)[Joint::Chest.index()].cast::<f32>();
    let (mut front, mut back) = ([0.0f32; 2], [0.0f32; 2]);
    let body = Bvh::new(&take.body.positions, &take.body.triangles);
    let normals = take.body.triangle_normals();
    for (v, p) in take.scan.positions.iter().enumerate() {
        let local = frame.inverse_transform_point(p);
        if local.x.abs() > 0.04 {
            continue;
        }
        let Some(hit) = body.closest(p, 0.1) else { continue };
        let joint = take.weights.joints[take.body.triangles[hit.triangle as usize][0] as usize][0];
        if JOINTS.get(joint as usize).is_none_or(|&j| part_of(j) != BodyPart::Torso) {
            continue;
        }
        let facing = (frame.rotation.inverse() * normals[hit.triangle as usize]).z;
        let side = if facing > 0.5 { &mut front } else { &mut back };
        if facing.abs() > 0.5 {
            side[0] += f32::from(u8::from(labels.garment[v]));
            side[1] += 1.0;
        }
    }
    let share = |s: [f32; 2]| s[0] / s[1].max(1.0);
    share(back) > 0.6 && share(front) < 0.6 * share(back)
}

/// The garment's own mesh: cut along the smoothed border, islands dropped, holes closed, remeshed.
fn garment_mesh(
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
fn bones(take: &Take) -> Vec<[Point3<f32>; 2]> {
    let at = take.pose.joint_positions(take.skeleton);
    JOINTS.iter().filter_map(|j| Some([at[j.parent()?.index()].cast::<f32>(), at[j.index()].cast::<f32>()])).collect()
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
