//! Layers that are moved apart together, all of them or what lies in one region.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_geometry::Mesh;

use crate::{
    StackSettings,
    contacts::{Contact, Contacts},
    fair::fair,
    push::{Cloth, Push, grow},
    untangle::untangle_but,
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
/// Rounds without progress after which layers are made smooth around what is left.
const PATIENCE: usize = 4;
/// Rings of vertices that are made smooth the first time, and how many more each time.
const FAIR_RINGS: usize = 2;
/// So many times more at most.
const MOST_FAIR: usize = 3;

/// Layers while they are moved; surface 0 is the body.
pub struct Pile {
    /// Inside to outside.
    pub surfaces: Vec<WornSurface>,
    /// Vertices that stay, by surface.
    held: Vec<Vec<bool>>,
    /// First vertex of each surface in `cloth`.
    starts: Vec<u32>,
    cloth: Cloth,
}

impl Pile {
    /// Meshes inside to outside with the gap of each, and which of their vertices stay.
    pub fn new(meshes: &[(Mesh, f32)], held: Vec<Vec<bool>>) -> Self {
        let surfaces: Vec<WornSurface> = meshes.par_iter().map(|(mesh, gap)| WornSurface::new(mesh, *gap)).collect();
        let mut all = Mesh::default();
        let mut starts = Vec::new();
        for surface in &surfaces {
            let start = all.positions.len() as u32;
            starts.push(start);
            all.positions.extend(&surface.mesh.positions);
            all.triangles.extend(surface.mesh.triangles.iter().map(|t| t.map(|v| v + start)));
        }
        Self { cloth: Cloth::new(&all, held.concat()), surfaces, held, starts }
    }

    /// Moves the layers apart. Returns the rounds it took.
    pub fn part(&mut self, settings: &StackSettings) -> usize {
        let mut contacts = Contacts::new(&self.surfaces);
        let mut patience = Patience::default();
        let (mut fewest, mut best) = (usize::MAX, Vec::new());
        let (mut fresh, mut dirty) = (true, vec![true; self.surfaces.len()]);
        for round in 0..settings.rounds {
            let found = self.found(&mut contacts, &patience, fresh, settings);
            if found.is_empty() {
                // Believed only after everything was looked at afresh and the layers were untangled.
                if fresh && !self.untangle(&mut dirty) {
                    return round + 1;
                }
                (contacts, fresh) = (Contacts::new(&self.surfaces), true);
                continue;
            }
            fresh = false;
            if found.len() < fewest {
                (fewest, best) = (found.len(), self.positions());
            }
            let before = self.positions();
            if patience.goes_on(found.len()) {
                self.push(&found, patience.rounds, settings);
            } else {
                self.fair_around(&found, FAIR_RINGS * patience.lost);
            }
            let moved = self.refresh(&before);
            dirty.iter_mut().zip(&moved).for_each(|(d, m)| *d |= !m.is_empty());
            contacts.moved(&self.surfaces, &moved, settings.reach);
        }
        // What was nearest to being parted.
        self.surfaces.iter_mut().zip(best).for_each(|(s, positions)| s.mesh.positions = positions);
        settings.rounds
    }

    fn positions(&self) -> Vec<Vec<Point3<f32>>> {
        self.surfaces.iter().map(|s| s.mesh.positions.clone()).collect()
    }

    /// Samples that lack their gap; where these are few, or now and then, crossings too. Only those that can move.
    fn found(
        &self,
        contacts: &mut Contacts,
        patience: &Patience,
        fresh: bool,
        settings: &StackSettings,
    ) -> Vec<Contact> {
        let round = patience.rounds;
        let mut found = contacts.samples(&self.surfaces, settings);
        if fresh || found.len() < FEW || round % LOOK_AGAIN == LOOK_AGAIN - 1 {
            // Each crossing asks for a little more than the last one, until it gives way.
            let more = (1.0 + 0.25 * round as f32).min(MOST_CROSSING);
            found.extend(contacts.crossings(&self.surfaces, more));
        }
        found.retain(|c| c.upper.corners.iter().any(|&v| !self.held[c.upper.surface][v as usize]));
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

    /// Makes both layers of each contact smooth around it.
    fn fair_around(&mut self, found: &[Contact], rings: usize) {
        let mut seeds = vec![Vec::new(); self.surfaces.len()];
        for anchor in found.iter().flat_map(|c| [c.upper, c.lower]).filter(|a| a.surface > 0) {
            seeds[anchor.surface].extend(anchor.corners);
        }
        for ((surface, seeds), held) in self.surfaces.iter_mut().zip(seeds).zip(&self.held) {
            let mut patch = grow(seeds, &surface.neighbors, rings);
            patch.retain(|&v| !held[v as usize]);
            fair(&mut surface.mesh, &surface.neighbors, &patch);
        }
    }

    /// Takes self-crossings out of the layers that moved. True where that changed anything.
    fn untangle(&mut self, dirty: &mut [bool]) -> bool {
        let before = self.positions();
        for (k, dirty) in dirty.iter_mut().enumerate().skip(1).filter(|(_, d)| **d) {
            untangle_but(&mut self.surfaces[k].mesh, &self.held[k]);
            *dirty = false;
        }
        self.refresh(&before).iter().any(|m| !m.is_empty())
    }

    /// How far vertices moved since `before`, by surface; empty for those where none did. Refreshes the others.
    fn refresh(&mut self, before: &[Vec<Point3<f32>>]) -> Vec<Vec<f32>> {
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
    /// How many times it was lost since less than half was left.
    lost: usize,
    left_then: usize,
    /// Rounds of pushing since it was lost.
    rounds: usize,
}

impl Patience {
    /// Takes note of the contacts left; false when they have not become fewer for some rounds.
    fn goes_on(&mut self, left: usize) -> bool {
        if self.best.is_none_or(|best| left < best) {
            (self.best, self.since) = (Some(left), 0);
        } else {
            self.since += 1;
        }
        self.rounds += 1;
        if self.since <= PATIENCE {
            return true;
        }
        let lost = if 2 * left < self.left_then { 1 } else { (self.lost + 1).min(MOST_FAIR) };
        *self = Self { lost, left_then: left, ..Self::default() };
        false
    }
}
