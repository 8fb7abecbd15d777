//! Layers that are moved apart together in one region.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_geometry::{Mesh, intersection::self_crossings, rims::grow};

use super::{
    contact::Contact,
    contacts::Contacts,
    fair::fair,
    layer::{Layer, crossing_pairs},
    patience::Patience,
    push::{Cloth, Push},
    region::Region,
};
use crate::{mesh::untangle::untangle_but, settings::StackSettings};

/// Crossings are pushed by at most this many gaps a round.
const MAX_CROSSING: f32 = 3.0;
/// A crossing asks for this many more gaps each round, until it gives way.
const MORE_EACH_ROUND: f32 = 0.25;
/// With fewer samples than this that lack their gap, crossings are looked for too.
const FEW: usize = 60;
/// Crossings are looked for in one of this many rounds in any case.
const LOOK_AGAIN: usize = 4;
/// Share of a push that the lower layer takes in the first round; it shrinks to nothing over `LOWER_ROUNDS`.
const LOWER_SHARE: f32 = 0.4;
const LOWER_ROUNDS: usize = 8;
/// Rings of vertices that are made smooth the first time, and how many more each time.
const FAIR_RINGS: usize = 2;
/// Rounds in which the spread of pushes halves.
const LOCAL_ROUNDS: f32 = 8.0;

/// A vertex that moved, by layer and index, and where to.
pub(super) type Moved = (usize, u32, Point3<f32>);

/// Moves the layers apart in one region. Returns what moved, and the rounds it took. In one `frame` of many, what did not end with
/// fewer crossings moves nothing: the next frame would start from it.
pub(super) fn part(region: &Region, layers: &[Layer], settings: &StackSettings, frame: bool) -> (Vec<Moved>, usize) {
    let mut pile = Pile::new(region, layers);
    let before = if frame { pile.crossing() } else { usize::MAX };
    let mut contacts = Contacts::new(&pile.layers);
    let mut patience = Patience::default();
    let (mut fewest, mut best) = (usize::MAX, Vec::new());
    let (mut fresh, mut dirty) = (true, vec![true; layers.len()]);
    for round in 0..settings.rounds {
        let mut found = contacts.samples(&pile.layers, settings.reach);
        if fresh || found.len() < FEW || patience.rounds % LOOK_AGAIN == LOOK_AGAIN - 1 {
            let gaps = (1.0 + MORE_EACH_ROUND * patience.rounds as f32).min(MAX_CROSSING);
            found.extend(contacts.crossings(&pile.layers, gaps));
        }
        found.retain(|c| c.upper.corners.iter().any(|&v| !pile.held[c.upper.layer][v as usize]));
        if found.is_empty() {
            // Believed only after everything was looked at afresh and the layers were untangled.
            if fresh && !pile.untangle(&mut dirty) {
                return (pile.moved(layers), round + 1);
            }
            (contacts, fresh) = (Contacts::new(&pile.layers), true);
            continue;
        }
        fresh = false;
        let before = pile.positions();
        if found.len() < fewest {
            (fewest, best) = (found.len(), before.clone());
        }
        if patience.goes_on(found.len()) {
            // Late rounds act locally, so that opposing pushes do not carry each other along.
            let spread = settings.spread / (1.0 + patience.rounds as f32 / LOCAL_ROUNDS);
            let displacement = pile.cloth.displacement(&pile.pushes(&found, patience.rounds), spread);
            pile.shift(&displacement);
        } else {
            pile.fair_around(&found, FAIR_RINGS * patience.lost);
        }
        let moved = pile.refresh(&before);
        dirty.iter_mut().zip(&moved).for_each(|(d, m)| *d |= !m.is_empty());
        contacts.moved_in(&[Region::everywhere()], &moved, &pile.layers, settings.reach);
    }
    // What was nearest to being parted.
    for (layer, positions) in pile.layers.iter_mut().zip(best) {
        layer.surface.mesh.positions = positions;
        layer.surface.refresh();
    }
    let better = !frame || pile.crossing() < before;
    (if better { pile.moved(layers) } else { Vec::new() }, settings.rounds)
}

/// Layers in a region while they are moved; layer 0 is the body.
struct Pile {
    /// Inside to outside.
    layers: Vec<Layer>,
    /// Vertices that stay, by layer.
    held: Vec<Vec<bool>>,
    /// Index of each vertex in the whole layer, by layer.
    origins: Vec<Vec<u32>>,
    /// First vertex of each layer in `cloth`.
    starts: Vec<u32>,
    cloth: Cloth,
}

impl Pile {
    fn new(region: &Region, whole: &[Layer]) -> Self {
        let parts = whole.iter().map(|layer| (region.part(layer.mesh()), layer.gap));
        let (meshes, origins): (Vec<(Mesh, f32)>, Vec<Vec<u32>>) =
            parts.map(|((mesh, origins), gap)| ((mesh, gap), origins)).unzip();
        let held = |(mesh, _): &(Mesh, f32)| mesh.positions.iter().map(|p| !region.holds(p)).collect();
        let held: Vec<Vec<bool>> = meshes.iter().map(held).collect();
        let layers: Vec<Layer> = meshes.par_iter().map(|(mesh, gap)| Layer::new(mesh, *gap)).collect();
        let (mut all, mut starts) = (Mesh::default(), Vec::new());
        for (mesh, _) in &meshes {
            let start = all.positions.len() as u32;
            starts.push(start);
            all.positions.extend(&mesh.positions);
            all.triangles.extend(mesh.triangles.iter().map(|t| t.map(|v| v + start)));
        }
        Self { cloth: Cloth::new(&all, held.concat()), layers, held, origins, starts }
    }

    /// Pairs of triangles that cross, of one layer or of two.
    fn crossing(&self) -> usize {
        let own = |layer: &Layer| self_crossings(layer.mesh(), &layer.surface.bvh).len();
        let with_lower = |k: usize| crossing_pairs(&self.layers, k).len();
        (1..self.layers.len()).map(|k| own(&self.layers[k]) + with_lower(k)).sum()
    }

    /// Vertices that lie elsewhere than in the `whole` layers.
    fn moved(&self, whole: &[Layer]) -> Vec<Moved> {
        let mut moved = Vec::new();
        for (k, origins) in self.origins.iter().enumerate().skip(1) {
            for (new, &v) in self.layers[k].mesh().positions.iter().zip(origins) {
                if *new != whole[k].mesh().positions[v as usize] {
                    moved.push((k, v, *new));
                }
            }
        }
        moved
    }

    fn positions(&self) -> Vec<Vec<Point3<f32>>> {
        self.layers.iter().map(|layer| layer.mesh().positions.clone()).collect()
    }

    /// The pushes that part the contacts; the lower layer takes a share of each in the first rounds.
    fn pushes(&self, found: &[Contact], round: usize) -> Vec<Push> {
        let fade = 1.0 - (round as f32 / LOWER_ROUNDS as f32).min(1.0);
        let mut pushes = Vec::with_capacity(2 * found.len());
        for contact in found {
            let share = if contact.lower.layer == 0 { 0.0 } else { LOWER_SHARE * fade };
            for (anchor, share) in [(contact.upper, 1.0 - share), (contact.lower, -share)] {
                let corners = anchor.corners.map(|v| v + self.starts[anchor.layer]);
                if share != 0.0 {
                    pushes.push(Push { corners, weights: anchor.weights, by: contact.by * share });
                }
            }
        }
        pushes
    }

    /// Moves vertices of the cloth.
    fn shift(&mut self, displacement: &[(u32, Vector3<f32>)]) {
        for &(v, by) in displacement {
            let layer = self.starts.partition_point(|&s| s <= v) - 1;
            self.layers[layer].surface.mesh.positions[(v - self.starts[layer]) as usize] += by;
        }
    }

    /// Makes both layers of each contact smooth around it.
    fn fair_around(&mut self, found: &[Contact], rings: usize) {
        let mut seeds = vec![Vec::new(); self.layers.len()];
        for anchor in found.iter().flat_map(|c| [c.upper, c.lower]).filter(|a| a.layer > 0) {
            seeds[anchor.layer].extend(anchor.corners);
        }
        for ((layer, seeds), held) in self.layers.iter_mut().zip(seeds).zip(&self.held) {
            let mut patch = grow(seeds, &layer.surface.neighbors, rings);
            patch.retain(|&v| !held[v as usize]);
            fair(&mut layer.surface.mesh, &layer.surface.neighbors, &patch);
        }
    }

    /// Takes self-crossings out of the layers that moved. True where that changed anything.
    fn untangle(&mut self, dirty: &mut [bool]) -> bool {
        let before = self.positions();
        for (k, dirty) in dirty.iter_mut().enumerate().skip(1).filter(|(_, d)| **d) {
            untangle_but(&mut self.layers[k].surface.mesh, &self.held[k]);
            *dirty = false;
        }
        self.refresh(&before).iter().any(|m| !m.is_empty())
    }

    /// How far vertices moved since `before`, by layer; empty for layers that did not. Refreshes the others.
    fn refresh(&mut self, before: &[Vec<Point3<f32>>]) -> Vec<Vec<f32>> {
        let refresh = |(layer, before): (&mut Layer, &Vec<_>)| {
            if layer.mesh().positions == *before {
                return Vec::new();
            }
            layer.surface.refresh();
            layer.mesh().positions.iter().zip(before).map(|(a, b)| (a - b).norm()).collect()
        };
        self.layers.par_iter_mut().zip(before).map(refresh).collect()
    }
}
