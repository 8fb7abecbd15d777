//! Every layer outside all layers below it (Hu et al. 2017, eq. 7, with the push spread over the cloth and repeated
//! until an exact test finds nothing).
//!
//! Points of the upper layer are held at least a gap over each lower one: its vertices, the points closest to the
//! lower layer's vertices, and the points where edges still cross. A round moves the cloth by the displacement field d
//! that minimises Σ (d(sample) − push)² · stiff + ∫ |∇d|² + |d|² / spread².

use rayon::prelude::*;
use serde::Serialize;
use toile_geometry::{
    Mesh,
    bvh::Bvh,
    intersection::{crossings, self_crossings},
};

use crate::{
    GarmentError, StackSettings,
    lower_surface::LowerSurface,
    push::{Push, crossing_pushes, displace},
    surface_solve::SurfaceSystem,
    untangle::untangle,
};

/// Pushes aim this much beyond the gap, so that rounds end.
const AIM: f32 = 1.15;
/// Heights under this share of the gap are pushed.
const ENOUGH: f32 = 0.9;
/// Lower vertices are looked at when the upper layer is this near, metres.
const NEAR: f32 = 0.02;
/// Crossings are pushed by at most this many gaps a round.
const MOST_CROSSING: f32 = 3.0;
/// Rounds without progress after which stacking gives up.
const PATIENCE: usize = 10;
/// Lower vertices in a parallel chunk.
const CHUNK: usize = 512;

/// Upper ends of the bins of [`LayerReport::gaps`], millimetres.
pub const GAP_BINS_MM: [f32; 6] = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0];

/// What stacking did to one layer.
#[derive(Debug, Clone, Default, Serialize)]
pub struct LayerReport {
    /// Rounds until nothing was left to push, or the most allowed.
    pub rounds: usize,
    /// True where every sample has its gap and no triangles cross.
    pub settled: bool,
    /// Pairs of crossing triangles with any lower layer after the last round.
    pub crossing_pairs: usize,
    /// Pairs of triangles of the layer itself that cross, before and after.
    pub self_crossings: [usize; 2],
    /// Least height of the layer's vertices over any lower layer, metres.
    pub least_gap_m: f32,
    /// Share of its vertices by their height over the nearest lower layer: bins end at [`GAP_BINS_MM`], the last is
    /// further away or over nothing.
    pub gaps: [f32; GAP_BINS_MM.len() + 1],
    /// Mean distance that its vertices moved, metres.
    pub moved_mean_m: f32,
    /// Largest distance that a vertex moved, metres.
    pub moved_max_m: f32,
}

/// What stacking did.
#[derive(Debug, Clone, Default, Serialize)]
pub struct StackReport {
    /// By layer, inside to outside.
    pub layers: Vec<LayerReport>,
}

/// Moves the `layers` (inside to outside, in the pose of `body`) so that each lies outside the body and all layers
/// below it. The body stays.
///
/// # Errors
/// [`GarmentError::Mesh`] where a mesh is broken. Layers that do not settle are told in the report.
pub fn stack(
    body: &Mesh,
    layers: &mut [Mesh],
    settings: &StackSettings,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<StackReport, GarmentError> {
    for mesh in std::iter::once(body).chain(layers.iter()) {
        mesh.validate().map_err(|e| GarmentError::Mesh(format!("a layer to stack: {e}")))?;
    }
    let mut report = StackReport::default();
    let count = layers.len();
    for k in 0..count {
        let (below, rest) = layers.split_at_mut(k);
        let lowers: Vec<LowerSurface> =
            std::iter::once(body).chain(below.iter()).filter(|m| !m.is_empty()).map(LowerSurface::new).collect();
        report.layers.push(push_out(&mut rest[0], &lowers, settings));
        progress((k + 1) as f32 / count as f32);
    }
    Ok(report)
}

fn push_out(upper: &mut Mesh, lowers: &[LowerSurface], settings: &StackSettings) -> LayerReport {
    if upper.is_empty() {
        return LayerReport { settled: true, ..LayerReport::default() };
    }
    let start = upper.positions.clone();
    let own_before = own_crossings(upper);
    let system = SurfaceSystem::new(upper);
    let mut watch = Watch::new(upper, lowers);
    let mut report = LayerReport::default();
    let mut fresh = false;
    let mut patience = Patience::default();
    for round in 0..settings.rounds {
        report.rounds = round + 1;
        let mut pushes = watch.samples(upper, lowers, settings);
        if pushes.is_empty() {
            // Each crossing asks for a little more than the last one, until it gives way.
            let more = (1.0 + 0.25 * round as f32).min(MOST_CROSSING);
            pushes = crossing_pushes(upper, lowers, settings.gap * more);
        }
        if pushes.is_empty() {
            // Believed only after the layer was untangled and everything was looked at afresh.
            if fresh {
                report.settled = true;
                break;
            }
            untangle(upper);
            (watch, fresh) = (Watch::new(upper, lowers), true);
            continue;
        }
        fresh = false;
        if !patience.goes_on(pushes.len()) {
            break;
        }
        // Late rounds act locally, so that opposing pushes do not carry each other along.
        let spread = settings.spread / (1.0 + round as f32 / 8.0);
        let moved = displace(upper, &system, &pushes, spread);
        watch.moved(&moved);
    }
    report.crossing_pairs = lowers.iter().map(|l| crossings(upper, l.mesh, &l.bvh).len()).sum();
    report.self_crossings = [own_before, own_crossings(upper)];
    let heights = heights(upper, lowers, settings);
    report.least_gap_m = heights.iter().copied().fold(settings.reach, f32::min);
    report.gaps = histogram(&heights);
    let moved: Vec<f32> = upper.positions.iter().zip(&start).map(|(a, b)| (a - b).norm()).collect();
    report.moved_mean_m = moved.iter().sum::<f32>() / moved.len().max(1) as f32;
    report.moved_max_m = moved.iter().copied().fold(0.0, f32::max);
    upper.recompute_normals();
    report
}

/// Gives up on layers that cannot be parted, such as a sheet through a limb.
#[derive(Default)]
struct Patience {
    best: Option<usize>,
    since: usize,
}

impl Patience {
    /// Takes note of the pushes left; false when they have not become fewer for some rounds.
    fn goes_on(&mut self, left: usize) -> bool {
        if self.best.is_none_or(|best| left < best) {
            (self.best, self.since) = (Some(left), 0);
        } else {
            self.since += 1;
        }
        self.since <= PATIENCE
    }
}

fn own_crossings(mesh: &Mesh) -> usize {
    self_crossings(mesh, &Bvh::new(&mesh.positions, &mesh.triangles)).len()
}

/// Height of every vertex over the lower layer that it is nearest to; infinite over none.
fn heights(upper: &Mesh, lowers: &[LowerSurface], settings: &StackSettings) -> Vec<f32> {
    let least =
        |p| lowers.iter().filter_map(|l| l.height(p, settings.reach)).map(|h| h.value).fold(f32::INFINITY, f32::min);
    upper.positions.par_iter().map(least).collect()
}

fn histogram(heights: &[f32]) -> [f32; GAP_BINS_MM.len() + 1] {
    let mut shares = [0.0; GAP_BINS_MM.len() + 1];
    for h in heights {
        let bin = GAP_BINS_MM.iter().position(|end| h * 1e3 < *end).unwrap_or(GAP_BINS_MM.len());
        shares[bin] += 1.0 / heights.len() as f32;
    }
    shares
}

/// Remembers how far each sample is from needing a push, so that a round looks only at those that may.
struct Watch {
    /// Slack of upper vertices, by lower layer.
    vertices: Vec<Vec<f32>>,
    /// Slack of lower vertices, by lower layer.
    lower_vertices: Vec<Vec<f32>>,
}

impl Watch {
    fn new(upper: &Mesh, lowers: &[LowerSurface]) -> Self {
        Self {
            vertices: vec![vec![0.0; upper.positions.len()]; lowers.len()],
            lower_vertices: lowers.iter().map(|l| vec![0.0; l.mesh.positions.len()]).collect(),
        }
    }

    /// Takes the distances moved off the slacks.
    fn moved(&mut self, moved: &[f32]) {
        let most = moved.iter().copied().fold(0.0, f32::max);
        self.vertices.iter_mut().for_each(|slacks| slacks.iter_mut().zip(moved).for_each(|(s, m)| *s -= m));
        self.lower_vertices.iter_mut().flatten().for_each(|s| *s -= most);
    }

    /// All pushes that upper vertices and the points nearest to lower vertices need.
    fn samples(&mut self, upper: &Mesh, lowers: &[LowerSurface], settings: &StackSettings) -> Vec<Push> {
        let bvh = Bvh::new(&upper.positions, &upper.triangles);
        let mut pushes = Vec::new();
        for (j, lower) in lowers.iter().enumerate() {
            let probe = |v: usize| probe_vertex(upper, lower, v, settings);
            look(&mut self.vertices[j], probe, &mut pushes);
            let probe = |u: usize| probe_lower_vertex(upper, &bvh, lower, u, settings);
            look(&mut self.lower_vertices[j], probe, &mut pushes);
        }
        pushes
    }
}

/// Probes whatever has no slack left; renews the slacks and collects the pushes in order.
fn look(slacks: &mut [f32], probe: impl Fn(usize) -> (f32, Option<Push>) + Sync, pushes: &mut Vec<Push>) {
    let found: Vec<Vec<Push>> = slacks
        .par_chunks_mut(CHUNK)
        .enumerate()
        .map(|(chunk, slacks)| {
            let mut found = Vec::new();
            for (i, slack) in slacks.iter_mut().enumerate().filter(|(_, s)| **s <= 0.0) {
                let (renewed, push) = probe(chunk * CHUNK + i);
                *slack = renewed;
                found.extend(push);
            }
            found
        })
        .collect();
    pushes.extend(found.into_iter().flatten());
}

/// Slack of an upper vertex over a lower layer, and the push that it needs.
fn probe_vertex(upper: &Mesh, lower: &LowerSurface, v: usize, settings: &StackSettings) -> (f32, Option<Push>) {
    let p = upper.positions[v];
    let Some(h) = lower.height(&p, settings.reach) else {
        // Beyond reach there is slack; beside a rim it has to be looked at again.
        let near = lower.bvh.closest(&p, settings.reach).is_some();
        return (if near { 0.0 } else { settings.reach - settings.gap }, None);
    };
    if h.value >= ENOUGH * settings.gap {
        return (h.value - ENOUGH * settings.gap, None);
    }
    let push = h.point + h.normal * (settings.gap * AIM) - p;
    (0.0, Some(Push { corners: [v as u32; 3], weights: [1.0, 0.0, 0.0], by: push }))
}

/// The same for the upper layer's point nearest to a lower vertex.
fn probe_lower_vertex(
    upper: &Mesh,
    bvh: &Bvh,
    lower: &LowerSurface,
    u: usize,
    settings: &StackSettings,
) -> (f32, Option<Push>) {
    let Some(hit) = bvh.closest(&lower.mesh.positions[u], NEAR) else { return (NEAR - settings.gap, None) };
    let Some(h) = lower.height(&hit.point, NEAR) else { return (0.0, None) };
    if h.value >= ENOUGH * settings.gap {
        return (h.value - ENOUGH * settings.gap, None);
    }
    let push = h.point + h.normal * (settings.gap * AIM) - hit.point;
    let corners = upper.triangles[hit.triangle as usize];
    (0.0, Some(Push { corners, weights: hit.barycentric, by: push }))
}
