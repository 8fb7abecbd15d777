//! Every layer outside all layers below it: Hu et al. 2017, eq. 7, as one problem over all layers, repeated until an
//! exact test finds nothing.
//!
//! A pass looks at all layers and then solves each [region](crate::region) where some come too near by itself, in
//! [rounds](crate::pile). Points of an upper layer are held at least a gap over each lower one: its vertices, the points
//! closest to the lower layer's vertices, and the points where edges still cross. A round moves all layers together by
//! the displacement field d that minimises Σ (d(point) − push)² · stiff + ∫ |∇d|² + |d|² / spread²; of what a pair has
//! to move apart the lower layer takes a share at first, so that what was scanned last is not the only one to give way,
//! and later none. Where that does not help, the layers are crumpled there: they are [made smooth](crate::fair) around
//! the place, wider each time. What is too near even then is [cut out](crate::cut_rest).

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_geometry::{Mesh, intersection::self_crossings};

use crate::{
    GarmentError, StackSettings,
    contacts::{Contact, Contacts, crossing_pairs},
    cut_rest::cut_rest,
    region::{Moved, Region, regions},
    stack_report::{LayerReport, StackReport},
    worn_surface::WornSurface,
};

/// Most times that all layers are looked at.
const PASSES: usize = 6;

/// Moves the `layers` (inside to outside, in the pose of `body`) so that each lies outside the body and all layers
/// below it, by a gap that grows with its `thickness` (metres, one a layer; what a scan shows is the outer side of
/// cloth): see [`StackSettings::gap_of`]. The body stays.
///
/// # Errors
/// [`GarmentError::Mesh`] where a mesh is broken, [`GarmentError::Mismatch`] where there is not a thickness for each
/// layer. Layers that do not settle are told in the report.
pub fn stack(
    body: &Mesh,
    layers: &mut [Mesh],
    thickness: &[f32],
    settings: &StackSettings,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<StackReport, GarmentError> {
    for mesh in std::iter::once(body).chain(layers.iter()) {
        mesh.validate().map_err(|e| GarmentError::Mesh(format!("a layer to stack: {e}")))?;
    }
    if thickness.len() != layers.len() {
        let reason = format!("{} layers have {} thicknesses", layers.len(), thickness.len());
        return Err(GarmentError::Mismatch(reason));
    }
    let gaps = thickness.iter().map(|t| settings.gap_of(*t));
    let meshes: Vec<(&Mesh, f32)> = std::iter::once((body, 0.0)).chain(layers.iter().zip(gaps)).collect();
    let mut surfaces: Vec<WornSurface> = meshes.into_par_iter().map(|(m, gap)| WornSurface::new(m, gap)).collect();
    let own_before = own_crossings(&surfaces);
    let (rounds, left) = settle(&mut surfaces, &own_before, settings, progress);
    let mut report = StackReport::default();
    for (k, layer) in layers.iter_mut().enumerate() {
        let cut_triangles = cut_rest(&mut surfaces, k + 1, &own_before[k + 1], &left);
        let stacked = &surfaces[k + 1];
        layer.triangles.clone_from(&stacked.mesh.triangles);
        let start = std::mem::replace(&mut layer.positions, stacked.mesh.positions.clone());
        let moved: Vec<f32> = layer.positions.iter().zip(&start).map(|(a, b)| (a - b).norm()).collect();
        let crossing = crossing_pairs(&surfaces, k + 1);
        let mut told = LayerReport {
            rounds,
            settled: crossing == 0 && left.iter().all(|c| c.upper.surface != k + 1),
            crossing_pairs: crossing,
            cut_triangles,
            gap_m: stacked.gap,
            self_crossings: [own_before[k + 1].len(), self_crossings(&stacked.mesh, &stacked.bvh).len()],
            ..LayerReport::default()
        };
        told.read_gaps(&surfaces[..=k + 1], settings);
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

/// Moves the layers apart, region by region. Returns the most rounds that a region took and the contacts that were left.
fn settle(
    surfaces: &mut [WornSurface],
    own_before: &[Vec<[u32; 2]>],
    settings: &StackSettings,
    progress: &(dyn Fn(f32) + Sync),
) -> (usize, Vec<Contact>) {
    let mut contacts = Contacts::new(surfaces);
    let mut own = own_before.to_vec();
    let (mut rounds, mut fresh) = (0, true);
    for pass in 0..PASSES {
        let left = too_near(&mut contacts, surfaces, settings);
        let tangled = own.iter().enumerate().flat_map(|(k, pairs)| pairs.iter().map(move |p| (k, p[0])));
        let tangled = tangled.map(|(k, t)| surfaces[k].mesh.corners(t as usize)[0]);
        let places = left.iter().map(|c| surfaces[c.upper.surface].mesh.positions[c.upper.corners[0] as usize]);
        let regions = regions(places.chain(tangled));
        if regions.is_empty() && fresh {
            return (rounds, left);
        }
        if regions.is_empty() {
            // Believed only after everything was looked at afresh.
            (contacts, fresh) = (Contacts::new(surfaces), true);
            continue;
        }
        fresh = false;
        let solved: Vec<(Vec<Moved>, usize)> = regions.par_iter().map(|r| r.solve(surfaces, settings)).collect();
        rounds = solved.iter().map(|s| s.1).fold(rounds, usize::max);
        let still = solved.iter().all(|s| s.0.is_empty());
        apply(surfaces, solved, &regions, &mut contacts, settings);
        own = own_crossings(surfaces);
        progress((pass + 1) as f32 / PASSES as f32);
        if still {
            break;
        }
    }
    (rounds, too_near(&mut Contacts::new(surfaces), surfaces, settings))
}

fn too_near(contacts: &mut Contacts, surfaces: &[WornSurface], settings: &StackSettings) -> Vec<Contact> {
    let mut left = contacts.samples(surfaces, settings);
    left.extend(contacts.crossings(surfaces, 1.0));
    left
}

/// Puts vertices where they were moved to.
fn apply(
    surfaces: &mut [WornSurface],
    solved: Vec<(Vec<Moved>, usize)>,
    regions: &[Region],
    contacts: &mut Contacts,
    settings: &StackSettings,
) {
    let mut moved = vec![Vec::new(); surfaces.len()];
    for (k, v, to) in solved.into_iter().flat_map(|s| s.0) {
        if moved[k].is_empty() {
            moved[k] = vec![0.0; surfaces[k].mesh.positions.len()];
        }
        let p: &mut Point3<f32> = &mut surfaces[k].mesh.positions[v as usize];
        moved[k][v as usize] = (to - *p).norm();
        *p = to;
    }
    surfaces.par_iter_mut().zip(&moved).filter(|(_, m)| !m.is_empty()).for_each(|(s, _)| s.refresh());
    contacts.moved_in(regions, &moved, surfaces, settings.reach);
}

/// Pairs of triangles of each layer itself that cross; none are looked for in the body.
fn own_crossings(surfaces: &[WornSurface]) -> Vec<Vec<[u32; 2]>> {
    let of = |(k, s): (usize, &WornSurface)| if k == 0 { Vec::new() } else { self_crossings(&s.mesh, &s.bvh) };
    surfaces.par_iter().enumerate().map(of).collect()
}
