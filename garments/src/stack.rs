//! Every layer outside all layers below it: Hu et al. 2017, eq. 7, as one problem over all layers, repeated until an
//! exact test finds nothing.
//!
//! Points of an upper layer are held at least a gap over each lower one: its vertices, the points closest to the lower
//! layer's vertices, and the points where edges still cross. A round moves all layers together by the displacement
//! field d that minimises Σ (d(point) − push)² · stiff + ∫ |∇d|² + |d|² / spread²; of what a pair has to move apart the
//! lower layer takes a share at first, so that what was scanned last is not the only one to give way, and later none.
//! Where that does not help, the layers are crumpled there: they are smoothed around the place, wider each time. The
//! few triangles that cross even then are cut out of the upper layer.

use nalgebra::Vector3;
use rayon::prelude::*;
use serde::Serialize;
use toile_geometry::{Mesh, intersection::self_crossings};

use crate::{
    GarmentError, StackSettings,
    contacts::{Contact, Contacts, crossing_pairs},
    cut_rest::cut_rest,
    push::{Cloth, Push, grow},
    untangle::{smooth, untangle},
    worn_surface::WornSurface,
};

/// Crossings are pushed by at most this many gaps a round.
const MOST_CROSSING: f32 = 3.0;
/// Fewer samples than this that lack their gap: crossings are looked for too.
const FEW: usize = 60;
/// Every so many rounds crossings are looked for in any case.
const LOOK_AGAIN: usize = 4;
/// Share of a push that the lower layer takes in the first round; it shrinks to nothing over so many rounds.
const LOWER_SHARE: f32 = 0.4;
const LOWER_ROUNDS: usize = 8;
/// Rounds without progress after which layers are smoothed around what is left.
const PATIENCE: usize = 4;
/// Rings of vertices that are smoothed the first time, and how many more each time.
const SMOOTH_RINGS: usize = 2;
/// Steps of that smoothing.
const SMOOTH_STEPS: usize = 6;

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
    /// Triangles that were cut out because they crossed to the last.
    pub cut_triangles: usize,
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
    /// Mean distance that those vertices moved which the scan saw (attribute `filled` under a half), metres.
    pub moved_seen_mean_m: f32,
    /// The distance that 95 % of those moved less than, metres.
    pub moved_seen_p95_m: f32,
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
    let mut pile = Pile::new(body, layers);
    let own_before: Vec<Vec<[u32; 2]>> = pile.surfaces[1..].iter().map(own_crossings).collect();
    let (rounds, left) = pile.part(settings, progress);
    let mut report = StackReport::default();
    for (k, layer) in layers.iter_mut().enumerate() {
        let cut_triangles = cut_rest(&mut pile.surfaces, k + 1, &own_before[k]);
        let stacked = &pile.surfaces[k + 1];
        layer.triangles.clone_from(&stacked.mesh.triangles);
        let start = std::mem::replace(&mut layer.positions, stacked.mesh.positions.clone());
        let moved: Vec<f32> = layer.positions.iter().zip(&start).map(|(a, b)| (a - b).norm()).collect();
        let crossing = crossing_pairs(&pile.surfaces, k + 1);
        let mut told = LayerReport {
            rounds,
            settled: crossing == 0 && left.iter().all(|c| c.upper.surface != k + 1),
            crossing_pairs: crossing,
            cut_triangles,
            self_crossings: [own_before[k].len(), own_crossings(stacked).len()],
            ..LayerReport::default()
        };
        told.read_gaps(&pile.surfaces[..=k + 1], settings);
        told.read_moves(layer, moved);
        report.layers.push(told);
        if layer.positions != start || cut_triangles > 0 {
            layer.recompute_normals();
            // Vertices that lost all their triangles keep some direction.
            layer.normals.iter_mut().filter(|n| n.norm_squared() == 0.0).for_each(|n| *n = Vector3::y());
        }
    }
    Ok(report)
}

/// All layers while they are moved; surface 0 is the body.
struct Pile {
    surfaces: Vec<WornSurface>,
    /// First vertex of each surface in `cloth`.
    starts: Vec<u32>,
    cloth: Cloth,
}

impl Pile {
    fn new(body: &Mesh, layers: &[Mesh]) -> Self {
        let surfaces: Vec<WornSurface> =
            std::iter::once(body).chain(layers).collect::<Vec<_>>().into_par_iter().map(WornSurface::new).collect();
        let mut all = Mesh::default();
        let mut starts = Vec::new();
        for surface in &surfaces {
            let start = all.positions.len() as u32;
            starts.push(start);
            all.positions.extend(&surface.mesh.positions);
            all.triangles.extend(surface.mesh.triangles.iter().map(|t| t.map(|v| v + start)));
        }
        Self { cloth: Cloth::new(&all), surfaces, starts }
    }

    /// Moves the layers apart. Returns the rounds it took and the contacts that were left.
    fn part(&mut self, settings: &StackSettings, progress: &(dyn Fn(f32) + Sync)) -> (usize, Vec<Contact>) {
        let mut contacts = Contacts::new(&self.surfaces);
        let mut patience = Patience::default();
        let (mut fresh, mut dirty) = (true, vec![true; self.surfaces.len()]);
        for round in 0..settings.rounds {
            let found = self.found(&mut contacts, round, fresh, settings);
            if found.is_empty() && fresh {
                // Believed only after the layers were untangled and everything was looked at afresh.
                if !self.untangle(&mut dirty) {
                    return (round + 1, found);
                }
            }
            if found.is_empty() {
                (contacts, fresh) = (Contacts::new(&self.surfaces), true);
                continue;
            }
            fresh = false;
            let before: Vec<_> = self.surfaces.iter().map(|s| s.mesh.positions.clone()).collect();
            if patience.goes_on(found.len()) {
                self.push(&found, round, settings);
            } else {
                self.smooth_around(&found, SMOOTH_RINGS * patience.lost());
            }
            let moved = self.refresh(&before);
            dirty.iter_mut().zip(&moved).for_each(|(d, m)| *d |= !m.is_empty());
            contacts.moved(&self.surfaces, &moved, settings.reach);
            progress((round + 1) as f32 / settings.rounds as f32);
        }
        (settings.rounds, Contacts::new(&self.surfaces).samples(&self.surfaces, settings))
    }

    /// Samples that lack their gap; where these are few, or now and then, crossings too.
    fn found(&self, contacts: &mut Contacts, round: usize, fresh: bool, settings: &StackSettings) -> Vec<Contact> {
        let mut found = contacts.samples(&self.surfaces, settings);
        if fresh || found.len() < FEW || round % LOOK_AGAIN == LOOK_AGAIN - 1 {
            // Each crossing asks for a little more than the last one, until it gives way.
            let more = (1.0 + 0.25 * round as f32).min(MOST_CROSSING);
            found.extend(contacts.crossings(&self.surfaces, settings.gap * more));
        }
        found
    }

    fn push(&mut self, found: &[Contact], round: usize, settings: &StackSettings) {
        let fade = 1.0 - (round as f32 / LOWER_ROUNDS as f32).min(1.0);
        let mut pushes = Vec::with_capacity(2 * found.len());
        for contact in found {
            let share = if contact.lower.surface == 0 { 0.0 } else { LOWER_SHARE * fade };
            for (anchor, share) in [(contact.upper, 1.0 - share), (contact.lower, -share)] {
                let corners = anchor.corners.map(|v| v + self.starts[anchor.surface]);
                if share != 0.0 {
                    pushes.push(Push { corners, weights: anchor.weights, by: contact.by * share });
                }
            }
        }
        // Late rounds act locally, so that opposing pushes do not carry each other along.
        let spread = settings.spread / (1.0 + round as f32 / 8.0);
        for (v, by) in self.cloth.displacement(&pushes, spread) {
            self.shift(v, by);
        }
    }

    fn shift(&mut self, v: u32, by: Vector3<f32>) {
        let surface = self.starts.partition_point(|&s| s <= v) - 1;
        self.surfaces[surface].mesh.positions[(v - self.starts[surface]) as usize] += by;
    }

    /// Smooths both layers of each contact around it.
    fn smooth_around(&mut self, found: &[Contact], rings: usize) {
        let mut seeds = vec![Vec::new(); self.surfaces.len()];
        for anchor in found.iter().flat_map(|c| [c.upper, c.lower]).filter(|a| a.surface > 0) {
            seeds[anchor.surface].extend(anchor.corners);
        }
        for (surface, seeds) in self.surfaces.iter_mut().zip(seeds).filter(|(_, s)| !s.is_empty()) {
            let patch = grow(seeds, &surface.neighbors, rings);
            smooth(&mut surface.mesh, &surface.neighbors, &patch, SMOOTH_STEPS);
        }
    }

    /// Takes self-crossings out of the layers that moved. True where that changed anything.
    fn untangle(&mut self, dirty: &mut [bool]) -> bool {
        let before: Vec<_> = self.surfaces.iter().map(|s| s.mesh.positions.clone()).collect();
        for (surface, dirty) in self.surfaces.iter_mut().zip(dirty).skip(1).filter(|(_, d)| **d) {
            untangle(&mut surface.mesh);
            *dirty = false;
        }
        self.refresh(&before).iter().any(|m| !m.is_empty())
    }

    /// How far vertices moved since `before`, by surface; empty for those where none did. Refreshes the others.
    fn refresh(&mut self, before: &[Vec<nalgebra::Point3<f32>>]) -> Vec<Vec<f32>> {
        let refresh = |(surface, before): (&mut WornSurface, &Vec<_>)| {
            if surface.mesh.positions == *before {
                return Vec::new();
            }
            surface.refresh();
            surface.mesh.positions.iter().zip(before).map(|(a, b)| (a - b).norm()).collect()
        };
        self.surfaces.par_iter_mut().zip(before).map(refresh).collect()
    }
}

/// Notices when rounds do not help.
#[derive(Default)]
struct Patience {
    best: Option<usize>,
    since: usize,
    lost: usize,
}

impl Patience {
    /// Takes note of the contacts left; false when they have not become fewer for some rounds.
    fn goes_on(&mut self, left: usize) -> bool {
        if self.best.is_none_or(|best| left < best) {
            (self.best, self.since) = (Some(left), 0);
        } else {
            self.since += 1;
        }
        if self.since > PATIENCE {
            *self = Self { best: None, since: 0, lost: self.lost + 1 };
            return false;
        }
        true
    }

    /// How many times it was lost.
    fn lost(&self) -> usize {
        self.lost
    }
}

fn own_crossings(surface: &WornSurface) -> Vec<[u32; 2]> {
    self_crossings(&surface.mesh, &surface.bvh)
}

impl LayerReport {
    /// Heights of every vertex of the last surface over the one below that it is nearest to.
    fn read_gaps(&mut self, surfaces: &[WornSurface], settings: &StackSettings) {
        let Some((upper, lowers)) = surfaces.split_last() else { return };
        let least = |p| lowers.iter().filter_map(|l| l.height(p, settings.reach)).fold(f32::INFINITY, f32::min);
        let heights: Vec<f32> = upper.mesh.positions.par_iter().map(least).collect();
        self.least_gap_m = heights.iter().copied().fold(settings.reach, f32::min);
        for h in &heights {
            let bin = GAP_BINS_MM.iter().position(|end| h * 1e3 < *end).unwrap_or(GAP_BINS_MM.len());
            self.gaps[bin] += 1.0 / heights.len() as f32;
        }
    }

    fn read_moves(&mut self, layer: &Mesh, moved: Vec<f32>) {
        let mean = |m: &[f32]| m.iter().sum::<f32>() / m.len().max(1) as f32;
        (self.moved_mean_m, self.moved_max_m) = (mean(&moved), moved.iter().copied().fold(0.0, f32::max));
        let filled = layer.attributes.get("filled");
        let seen = |v: usize| filled.is_none_or(|f| f[v] < 0.5);
        let mut seen: Vec<f32> = (0..moved.len()).filter(|&v| seen(v)).map(|v| moved[v]).collect();
        self.moved_seen_mean_m = mean(&seen);
        seen.sort_by(f32::total_cmp);
        self.moved_seen_p95_m = seen.get(seen.len() * 95 / 100).copied().unwrap_or(0.0);
    }
}
