//! Garments made on a person, each fully outside the ones below.
//!
//! Cloth is a level set: the distance to the body, blurred so that cloth bridges hollows, joined with straight-hanging
//! tubes where it drapes, less the garment's ease, and never nearer to the layers below than a gap. The level is meshed,
//! cut where the garment ends, creased outwards and given the body's weights.

use nalgebra::Point3;
use rayon::prelude::*;
use toile_character::{BodyModel, SkinWeights, SkinnedMesh, transfer::closest_triangle_weights};
use toile_geometry::{Mesh, topology::VertexNeighbors};

use crate::{
    SyntheticError, cut,
    field::{Field, Grid, signed_distance},
    noise, pattern,
    person::Person,
    random::Random,
    settings::{GarmentKind, GarmentSettings, SyntheticSettings},
    surface_nets,
    tailor::tailor,
    tailoring::{Limb, Tailoring},
    tubes::Tubes,
};

/// Smallest distance between two layers as they are made, metres.
const GAP: f32 = 0.005;
/// Space around the body that cloth may fill, metres.
const MARGIN: f32 = 0.14;
/// Blur of the distance over ±this length, metres, so that cloth bridges hollows.
const BRIDGE: f32 = 0.018;
/// How much wider a garment is cut for each layer below it, metres.
const PADDING: f32 = 0.008;
/// A garment's solid ends this far beyond its cut, metres.
const OVERLAP: f32 = 0.02;
/// Rounds of smoothing of the weights: cloth does not follow one leg alone.
const WEIGHT_ROUNDS: usize = 20;
/// Parts smaller than this share of a garment are crumbs of the cut.
const CRUMB: f32 = 0.1;

/// A garment on its person.
#[derive(Debug, Clone)]
pub struct Garment {
    /// Name of its kind.
    pub name: String,
    /// Its cut.
    pub kind: GarmentKind,
    /// An open sheet in the body's rest pose, coloured, weighted on the body's skeleton.
    pub worn: SkinnedMesh,
}

/// Makes the garments of `settings` from the inside out.
///
/// # Errors
/// [`SyntheticError::Garment`] where nothing of a garment is left after cutting.
pub fn make_all(
    model: &BodyModel,
    person: &Person,
    settings: &SyntheticSettings,
) -> Result<Vec<Garment>, SyntheticError> {
    let Some((lo, hi)) = person.body.mesh.bounds().filter(|_| !settings.garments.is_empty()) else {
        return Ok(Vec::new());
    };
    let grid = Grid::covering(lo, hi, MARGIN, settings.cell_m);
    let mut wardrobe = Wardrobe::new(person, &grid);
    let mut garments = Vec::new();
    for (n, wanted) in settings.garments.iter().enumerate() {
        let mut random = Random::new(settings.seed, &format!("garment {n} {}", wanted.kind.name()));
        let tailoring = tailor(wanted.kind, model, person, &mut random);
        garments.push(wardrobe.add(wanted, &tailoring, random.seed())?);
    }
    Ok(garments)
}

/// The person with the garments made so far.
struct Wardrobe<'a> {
    person: &'a Person,
    /// Distance to the body, blurred.
    bridged: Field,
    /// About the distance to the outermost layer.
    outermost: Field,
    /// Limb that each node is nearest to.
    limbs: Vec<Limb>,
    /// How many garments there are.
    layers: usize,
}

impl<'a> Wardrobe<'a> {
    fn new(person: &'a Person, grid: &Grid) -> Self {
        let (body, nearest) = signed_distance(&person.body.mesh, grid);
        let limb = |&t: &u32| match person.body.mesh.triangles.get(t as usize) {
            Some(triangle) => Limb::of(person.regions[triangle[0] as usize]),
            None => Limb::Trunk,
        };
        let radius = (BRIDGE / grid.cell).round().max(1.0) as usize;
        let limbs = nearest.iter().map(limb).collect();
        Self { person, bridged: body.blurred(radius, 2), limbs, outermost: body, layers: 0 }
    }

    fn add(&mut self, wanted: &GarmentSettings, cut_to: &Tailoring, seed: u64) -> Result<Garment, SyntheticError> {
        let name = wanted.kind.name().to_string();
        let cloth = self.level(cut_to);
        let outside = |p: &Point3<f32>| cut_to.outside(p, self.limbs[self.bridged.grid.nearest(p)]);
        let whole = surface_nets::mesh(&cloth, |p| outside(p) < 0.03);
        let scalar: Vec<f32> = whole.positions.iter().map(outside).collect();
        let mut mesh = cut::drop_crumbs(&cut::keep_negative(&whole, &scalar), CRUMB);
        if mesh.is_empty() {
            return Err(SyntheticError::Garment { name, reason: "nothing is left of it after cutting".into() });
        }
        crease(&mut mesh, cut_to, seed);
        mesh.colors = pattern::colors(&mesh.positions, &wanted.pattern, seed);
        let worn = self.weighted(mesh);
        self.outermost = self.joined(&cloth, cut_to);
        self.layers += 1;
        Ok(Garment { name, kind: wanted.kind, worn })
    }

    /// The field whose zero level is the uncut, uncreased cloth.
    fn level(&self, cut_to: &Tailoring) -> Field {
        let grid = &self.bridged.grid;
        let tubes = Tubes::new(self.person, grid, cut_to);
        let padding = PADDING * self.layers as f32;
        let free = Field::from_fn(grid, |i, p| {
            let body = self.bridged.values[i] - padding;
            let tube =
                if self.limbs[i] == Limb::Trunk { tubes.distance(grid.node(i)[1], p) - padding } else { f32::INFINITY };
            body + cut_to.drape * (tube - body).min(0.0) - ease_at(cut_to, p)
        });
        let mut cloth = free.blurred(1, 2);
        for (value, below) in cloth.values.iter_mut().zip(&self.outermost.values) {
            *value = value.min(below - GAP);
        }
        cloth
    }

    /// The layers so far joined with a new one, creases included.
    fn joined(&self, cloth: &Field, cut_to: &Tailoring) -> Field {
        Field::from_fn(&cloth.grid, |i, p| {
            let within = cut_to.outside(p, self.limbs[i]) - OVERLAP;
            self.outermost.values[i].min((cloth.values[i] - cut_to.creases).max(within))
        })
    }

    fn weighted(&self, mesh: Mesh) -> SkinnedMesh {
        let body = &self.person.body;
        let weights = closest_triangle_weights(&body.mesh, &body.weights, &mesh.positions);
        let weights = smoothed(&weights, &mesh);
        SkinnedMesh { mesh, skeleton: body.skeleton.clone(), weights }
    }
}

fn ease_at(cut_to: &Tailoring, p: &Point3<f32>) -> f32 {
    let below = (cut_to.drape_from - p.y).max(0.0);
    let share = (below / (cut_to.drape_from - cut_to.lower_end).max(0.05)).min(1.0);
    let fold = 0.5 + 0.5 * (9.0 * p.x.atan2(p.z)).cos();
    cut_to.ease + cut_to.flare * below + cut_to.pleats * share * fold
}

/// Creases stand outwards only, so that they never touch the layers below.
fn crease(mesh: &mut Mesh, cut_to: &Tailoring, seed: u64) {
    let normals = mesh.vertex_normals();
    for (p, n) in mesh.positions.iter_mut().zip(normals) {
        let wave = noise::layered(p, cut_to.crease_length, seed);
        *p += n * (cut_to.creases * (0.5 + 0.7 * wave).clamp(0.0, 1.0));
    }
}

/// Weights averaged over neighbours, [`WEIGHT_ROUNDS`] times.
fn smoothed(weights: &SkinWeights, mesh: &Mesh) -> SkinWeights {
    let neighbours = VertexNeighbors::new(mesh.positions.len(), &mesh.triangles);
    let mut rows: Vec<Vec<(u8, f32)>> = (0..weights.len()).map(|v| weights.of(v).collect()).collect();
    for _ in 0..WEIGHT_ROUNDS {
        rows = (0..rows.len()).into_par_iter().map(|v| mean_row(&rows, v, neighbours.of(v))).collect();
    }
    let mut out = SkinWeights::default();
    rows.iter().for_each(|row| out.push(row));
    out
}

fn mean_row(rows: &[Vec<(u8, f32)>], v: usize, neighbours: &[u32]) -> Vec<(u8, f32)> {
    let mut sum = [0.0f32; toile_character::JOINT_COUNT];
    for row in neighbours.iter().map(|&n| &rows[n as usize]).chain([&rows[v]]) {
        row.iter().for_each(|&(joint, weight)| sum[joint as usize] += weight);
    }
    let total = 1.0 + neighbours.len() as f32;
    let kept = sum.iter().enumerate().filter(|(_, s)| **s > 1e-4 * total);
    kept.map(|(joint, s)| (joint as u8, s / total)).collect()
}
