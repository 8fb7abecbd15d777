//! Every layer outside all layers below it: Hu et al. 2017, eq. 7, as one problem over all layers, repeated until an
//! exact test finds nothing.
//!
//! A pass looks at all layers and then solves each [region] in which some come too near, in [rounds](pile).
//! Points of an upper layer are held at least a gap over each lower one: its vertices, the points closest to the lower
//! layer's vertices, and the points where edges still cross. A round moves all layers together by the displacement field
//! d that minimises Σ (d(point) − push)² · stiff + ∫ |∇d|² + |d|² / spread². The lower layer takes a share of what a pair
//! has to move apart in the first rounds, so that the last scanned layer is not the only one to give way. Where that does
//! not help, the layers are crumpled there: they are [made smooth](fair) around the place, wider each time. What is too
//! near even then is [cut out](cut_rest).
//!
//! The seed's own way, one push along the normal, is [`push_out`].

mod apart;
mod contact;
mod contacts;
mod cut_rest;
mod fair;
mod layer;
mod patience;
mod pile;
pub mod press;
mod push;
mod push_out;
mod region;
pub mod report;
mod swept;

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_geometry::{
    Mesh,
    intersection::{self_crossings, self_crossings_among},
};

pub use self::apart::Apart;
use self::{
    contact::Contact,
    contacts::Contacts,
    cut_rest::cut_rest,
    layer::{Layer, crossing_pairs},
    pile::{Moved, part},
    push_out::push_along_normals,
    region::{Region, regions},
    report::{LayerReport, StackReport},
};
use crate::{
    error::GarmentError,
    settings::{StackMethod, StackSettings},
};

/// How much work is taken.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Care {
    /// A result that stays: layers keep their gaps, which is believed only after everything was looked at afresh.
    Lasting,
    /// One frame of many: layers do not cross.
    Frame,
}

impl Care {
    /// Limit of the times that all layers are looked at.
    fn passes(self) -> usize {
        if self == Self::Frame { 2 } else { 6 }
    }

    /// Vertices this far from a place where layers come too near may move, metres. From one frame to the next layers come into each
    /// other by millimetres: they are given more room only where that does not help.
    fn margin(self, pass: usize) -> f32 {
        match (self, pass) {
            (Self::Frame, 0) => 0.025,
            _ => 0.06,
        }
    }
}

/// Moves the `layers` (inside to outside, in the pose of `body`) so that each lies outside the body and all layers
/// below it, by a gap that grows with its `thickness` (metres, one for each layer; a scan shows the outer side of cloth):
/// see [`StackSettings::gap_of`]. The body stays.
///
/// # Errors
/// [`GarmentError::Mesh`] where a mesh is broken, [`GarmentError::Mismatch`] where there is not a thickness for each
/// layer, [`GarmentError::Settings`] where a setting is outside of its range. Layers that do not settle are in the report.
pub fn stack(
    body: &Mesh,
    layers: &mut [Mesh],
    thickness: &[f32],
    settings: &StackSettings,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<StackReport, GarmentError> {
    settings.check()?;
    check(body, layers, thickness)?;
    let gaps = thickness.iter().map(|t| settings.gap_of(*t));
    let meshes: Vec<(&Mesh, f32)> = std::iter::once((body, 0.0)).chain(layers.iter().zip(gaps)).collect();
    let mut worn: Vec<Layer> = meshes.into_par_iter().map(|(mesh, gap)| Layer::new(mesh, gap)).collect();
    let own_before = own_crossings(&worn);
    let (rounds, left) = match settings.method {
        StackMethod::Regions => settle(&mut worn, &own_before, settings, Care::Lasting, progress),
        StackMethod::PushAlongNormal => {
            push_along_normals(&mut worn, settings);
            (1, too_near(&mut Contacts::new(&worn), &worn, settings))
        }
    };
    let mut report = StackReport::default();
    for (k, layer) in (1..).zip(layers) {
        let cut_triangles = match settings.method {
            StackMethod::Regions => cut_rest(&mut worn, k, &own_before[k], &left),
            StackMethod::PushAlongNormal => 0,
        };
        let moved = take_over(layer, worn[k].mesh());
        let crossing_pairs = crossing_pairs(&worn, k).len();
        let own_after = self_crossings(worn[k].mesh(), &worn[k].surface.bvh).len();
        let mut of_layer = LayerReport {
            rounds,
            settled: crossing_pairs == 0 && left.iter().all(|c| c.upper.layer != k),
            crossing_pairs,
            cut_triangles,
            gap_m: worn[k].gap,
            self_crossings: [own_before[k].len(), own_after],
            ..LayerReport::default()
        };
        of_layer.read_gaps(&worn[..=k], settings);
        of_layer.read_moves(layer, &moved);
        report.layers.push(of_layer);
    }
    Ok(report)
}

fn check(body: &Mesh, layers: &[Mesh], thickness: &[f32]) -> Result<(), GarmentError> {
    for mesh in std::iter::once(body).chain(layers) {
        mesh.validate().map_err(|e| GarmentError::Mesh(format!("a layer to stack: {e}")))?;
    }
    if thickness.len() != layers.len() {
        let reason = format!("{} layers have {} thicknesses", layers.len(), thickness.len());
        return Err(GarmentError::Mismatch(reason));
    }
    Ok(())
}

/// Gives `layer` the positions and triangles of its stacked mesh. Returns how far each vertex moved, metres.
fn take_over(layer: &mut Mesh, stacked: &Mesh) -> Vec<f32> {
    let start = std::mem::replace(&mut layer.positions, stacked.positions.clone());
    if layer.positions != start || layer.triangles != stacked.triangles {
        layer.triangles.clone_from(&stacked.triangles);
        layer.recompute_normals();
        // Vertices that lost all their triangles keep some direction.
        layer.normals.iter_mut().filter(|n| n.norm_squared() == 0.0).for_each(|n| *n = Vector3::y());
    }
    layer.positions.iter().zip(&start).map(|(a, b)| (a - b).norm()).collect()
}

/// Moves the layers apart, region by region. Returns the most rounds that a region took, and the contacts that are left.
fn settle(
    layers: &mut [Layer],
    own_before: &[Vec<[u32; 2]>],
    settings: &StackSettings,
    care: Care,
    progress: &(dyn Fn(f32) + Sync),
) -> (usize, Vec<Contact>) {
    let mut contacts = Contacts::new(layers);
    let mut own = own_before.to_vec();
    let (mut rounds, mut fresh) = (0, true);
    for pass in 0..care.passes() {
        let left = match care {
            Care::Lasting => too_near(&mut contacts, layers, settings),
            Care::Frame => contacts.crossings(layers, 1.0),
        };
        let places = left.iter().map(|c| place(layers, c)).chain(tangled(layers, &own));
        let regions = regions(places, care.margin(pass));
        if regions.is_empty() && (fresh || care == Care::Frame) {
            return (rounds, left);
        }
        if regions.is_empty() {
            // Believed only after everything was looked at afresh.
            (contacts, fresh) = (Contacts::new(layers), true);
            continue;
        }
        fresh = false;
        let solved: Vec<(Vec<Moved>, usize)> =
            regions.par_iter().map(|r| part(r, layers, settings, care == Care::Frame)).collect();
        rounds = solved.iter().map(|s| s.1).fold(rounds, usize::max);
        let still = solved.iter().all(|s| s.0.is_empty());
        let moved = apply(layers, solved, &regions, &mut contacts, settings);
        own = own_crossings_after(layers, &own, &moved);
        progress((pass + 1) as f32 / care.passes() as f32);
        if still {
            break;
        }
    }
    match care {
        Care::Lasting => (rounds, too_near(&mut Contacts::new(layers), layers, settings)),
        Care::Frame => (rounds, contacts.crossings(layers, 1.0)),
    }
}

/// Where a contact is.
fn place(layers: &[Layer], contact: &Contact) -> Point3<f32> {
    layers[contact.upper.layer].mesh().positions[contact.upper.corners[0] as usize]
}

/// Where layers cross themselves, by their pairs of crossing triangles.
fn tangled<'a>(layers: &'a [Layer], own: &'a [Vec<[u32; 2]>]) -> impl Iterator<Item = Point3<f32>> + 'a {
    let pairs = layers.iter().zip(own).flat_map(|(layer, pairs)| pairs.iter().map(move |pair| (layer, pair[0])));
    pairs.map(|(layer, t)| layer.mesh().corners(t as usize)[0])
}

fn too_near(contacts: &mut Contacts, layers: &[Layer], settings: &StackSettings) -> Vec<Contact> {
    let mut left = contacts.samples(layers, settings.reach);
    left.extend(contacts.crossings(layers, 1.0));
    left
}

/// Puts vertices where they were moved to. Returns how far each one went, by layer; empty for layers that stayed.
fn apply(
    layers: &mut [Layer],
    solved: Vec<(Vec<Moved>, usize)>,
    regions: &[Region],
    contacts: &mut Contacts,
    settings: &StackSettings,
) -> Vec<Vec<f32>> {
    let mut moved = vec![Vec::new(); layers.len()];
    for (k, v, to) in solved.into_iter().flat_map(|s| s.0) {
        if moved[k].is_empty() {
            moved[k] = vec![0.0; layers[k].mesh().positions.len()];
        }
        let p = &mut layers[k].surface.mesh.positions[v as usize];
        moved[k][v as usize] = (to - *p).norm();
        *p = to;
    }
    layers.par_iter_mut().zip(&moved).filter(|(_, m)| !m.is_empty()).for_each(|(layer, _)| layer.surface.refresh());
    contacts.moved_in(regions, &moved, layers, settings.reach);
    moved
}

/// Pairs of triangles of each layer that cross within it; the body's are not looked for.
fn own_crossings(layers: &[Layer]) -> Vec<Vec<[u32; 2]>> {
    let of = |(k, layer): (usize, &Layer)| {
        if k == 0 { Vec::new() } else { self_crossings(layer.mesh(), &layer.surface.bvh) }
    };
    layers.par_iter().enumerate().map(of).collect()
}

/// As [`own_crossings`], where `before` holds what crossed until the vertices `moved`.
fn own_crossings_after(layers: &[Layer], before: &[Vec<[u32; 2]>], moved: &[Vec<f32>]) -> Vec<Vec<[u32; 2]>> {
    let of = |(k, layer): (usize, &Layer)| {
        if k == 0 || moved[k].is_empty() {
            return before[k].clone();
        }
        let mesh = layer.mesh();
        let went = |t: u32| mesh.triangles[t as usize].iter().any(|&v| moved[k][v as usize] > 0.0);
        let some: Vec<u32> = (0..mesh.triangles.len() as u32).filter(|&t| went(t)).collect();
        let mut pairs: Vec<[u32; 2]> = before[k].iter().copied().filter(|p| !p.iter().any(|&t| went(t))).collect();
        pairs.extend(self_crossings_among(mesh, &some, &layer.surface.bvh));
        pairs.sort_unstable();
        pairs
    };
    layers.par_iter().enumerate().map(of).collect()
}
