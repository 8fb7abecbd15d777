//! A generic garment takes on the shape of a scanned one (the conformation of the V-Man project, paper 004 §2.1.3): its rims go to the
//! scanned rims, everything between to the scanned surface, under an elastic energy that is stiff first and soft in the end.
//!
//! Minimised over the displacement d of all vertices in each round: Σ area · wᵢ |dᵢ − δᵢ|² + ℓ² ∫ |∇d|², with ℓ from the width of a limb
//! down to that of a triangle. Where nothing is near, w is 0 and the surroundings decide. In the first rounds rims alone count: sleeves
//! and hems come to their length evenly, before the surface holds each point where it is.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_geometry::{
    Mesh, bvh::Bvh, mesh::vertex_normals, rims::open_vertices, surface_solve::SurfaceSystem, topology::Edges,
};

use super::rims::{Rim, partners, rims};

/// The length ℓ in each round, metres.
const STIFFNESS: [f32; 14] = [0.30, 0.20, 0.12, 0.08, 0.05, 0.05, 0.05, 0.04, 0.03, 0.022, 0.016, 0.012, 0.009, 0.008];
/// Rounds in which rims alone count, and what the surface weighs in them.
const RIM_ROUNDS: usize = 5;
const FAINT: f32 = 1e-3;
/// The surface is looked for within this distance in the first round, metres.
const REACH: f32 = 0.10;
/// The reach shrinks to this share.
const LAST: f32 = 0.3;
/// What a rim weighs against a vertex elsewhere: so much more that it is met.
const RIM_WEIGHT: f32 = 20.0;
/// Surfaces belong together where they face alike (cosine).
const ALIKE: f32 = 0.3;
/// Share of a corner in a point from which on the point lies on it.
const ON_CORNER: f32 = 1e-3;

/// How near a conformed garment came.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Nearness {
    /// Mean distance of its vertices from the scanned garment, metres.
    pub to_scan: f32,
    /// Mean distance of the scanned garment's vertices from it, metres.
    pub from_scan: f32,
}

/// Rims of `start` and of the scanned garment that have no partner.
pub(super) fn unmatched(start: &Mesh, scanned: &Mesh) -> usize {
    let (own, there) = (rims(start), rims(scanned));
    let matched = partners(&own, &there).into_iter().flatten().count();
    own.len() + there.len() - 2 * matched
}

/// The vertices of `start` on the scanned garment.
pub(super) fn conformed(start: &Mesh, scanned: &Mesh) -> Mesh {
    let target = Target::new(start, scanned);
    let system = SurfaceSystem::new(start);
    let mut mesh = start.clone();
    for (round, length) in STIFFNESS.into_iter().enumerate() {
        let share = 1.0 - (1.0 - LAST) * round as f32 / (STIFFNESS.len() - 1) as f32;
        let pulls = target.pulls(&mesh, share, if round < RIM_ROUNDS { FAINT } else { 1.0 });
        let anchors: Vec<f32> = pulls.iter().map(|(_, w)| w / (length * length)).collect();
        let along = |k: usize| {
            let wanted = |((to, w), p): (&(Point3<f32>, f32), &Point3<f32>)| if *w > 0.0 { to[k] - p[k] } else { 0.0 };
            let wanted: Vec<f32> = pulls.iter().zip(&start.positions).map(wanted).collect();
            system.smoothed(&wanted, &anchors)
        };
        let [x, y, z] = [along(0), along(1), along(2)];
        for (v, p) in start.positions.iter().enumerate() {
            mesh.positions[v] = p + Vector3::new(x[v], y[v], z[v]);
        }
    }
    mesh.recompute_normals();
    mesh
}

/// How near `mesh` is to `scanned`, both ways.
pub(super) fn nearness(mesh: &Mesh, scanned: &Mesh) -> Nearness {
    let between = |a: &Mesh, b: &Mesh| {
        let bvh = Bvh::new(&b.positions, &b.triangles);
        let far = |p: &Point3<f32>| bvh.closest(p, f32::INFINITY).map_or(0.0, |hit| f64::from(hit.distance));
        let all: Vec<f64> = a.positions.par_iter().map(far).collect();
        (all.iter().sum::<f64>() / all.len().max(1) as f64) as f32
    };
    Nearness { to_scan: between(mesh, scanned), from_scan: between(scanned, mesh) }
}

/// The scanned garment, and which of its rims is which of the generic one's.
struct Target<'a> {
    mesh: &'a Mesh,
    bvh: Bvh,
    normals: Vec<Vector3<f32>>,
    is_rim: Vec<bool>,
    /// Vertices of the generic garment that belong to one place.
    fixed: Vec<(u32, Point3<f32>)>,
    /// Rims of the generic garment that belong somewhere on a rim of this one.
    open: Vec<(Rim, Rim)>,
}

impl<'a> Target<'a> {
    fn new(start: &Mesh, mesh: &'a Mesh) -> Self {
        let (own, there) = (rims(start), rims(mesh));
        let (mut fixed, mut open) = (Vec::new(), Vec::new());
        for (rim, partner) in own.iter().zip(partners(&own, &there)) {
            match partner.map(|j| &there[j]) {
                Some(other) if rim.is_ring() && other.is_ring() => {
                    fixed.extend(rim.points.iter().map(|p| p.vertex).zip(rim.around(other)));
                }
                Some(other) => open.push((rim.clone(), other.clone())),
                None => {}
            }
        }
        let is_rim = open_vertices(&Edges::new(&mesh.triangles), mesh.positions.len());
        let bvh = Bvh::new(&mesh.positions, &mesh.triangles);
        Self { mesh, bvh, normals: mesh.triangle_normals(), is_rim, fixed, open }
    }

    /// Where each vertex of `mesh` belongs, and how much that weighs, `inside` away from rims; 0 where nothing is near within a `share` of
    /// the reach.
    fn pulls(&self, mesh: &Mesh, share: f32, inside: f32) -> Vec<(Point3<f32>, f32)> {
        let normals = vertex_normals(&mesh.positions, &mesh.triangles);
        let surface = |(p, n): (&Point3<f32>, &Vector3<f32>)| {
            let (to, weight) = self.surface(p, n, share * REACH);
            (to, inside * weight)
        };
        let mut pulls: Vec<(Point3<f32>, f32)> = mesh.positions.par_iter().zip(&normals).map(surface).collect();
        self.fixed.iter().for_each(|&(v, to)| pulls[v as usize] = (to, RIM_WEIGHT));
        for (rim, other) in &self.open {
            for point in &rim.points {
                let p = &mut pulls[point.vertex as usize];
                *p = other.nearest(&mesh.positions[point.vertex as usize], point).map_or(*p, |to| (to, RIM_WEIGHT));
            }
        }
        pulls
    }

    fn surface(&self, p: &Point3<f32>, normal: &Vector3<f32>, reach: f32) -> (Point3<f32>, f32) {
        let is_alike = |t: u32| self.normals[t as usize].dot(normal) > ALIKE;
        let Some(hit) = self.bvh.closest_where(p, reach, is_alike) else { return (*p, 0.0) };
        let corners = self.mesh.triangles[hit.triangle as usize].iter().zip(hit.barycentric);
        // Cloth beyond the rim: the rim itself says where that belongs.
        let mut touched = corners.filter(|(_, w)| *w > ON_CORNER);
        if touched.all(|(&v, _)| self.is_rim[v as usize]) { (*p, 0.0) } else { (hit.point, 1.0) }
    }
}
