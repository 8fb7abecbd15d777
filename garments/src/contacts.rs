//! Where layers come too near to one another, and how they have to move apart.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_geometry::{
    intersection::{crossings, crossings_among, segment_crosses},
    triangle::ray_hit,
};

use crate::{
    StackSettings,
    region::Region,
    worn_surface::{Place, WornSurface},
};

/// Pushes aim this much beyond the gap, so that rounds end.
const AIM: f32 = 1.15;
/// Heights under this share of the gap are pushed.
const ENOUGH: f32 = 0.8;
/// Lower vertices are looked at when the upper layer is this near, metres.
const NEAR: f32 = 0.02;
/// Samples in a parallel chunk.
const CHUNK: usize = 512;

/// Two points, one on each of two layers, that have to move apart.
#[derive(Debug, Clone, Copy)]
pub struct Contact {
    /// The outer layer and the point on it.
    pub upper: Anchor,
    /// The layer below and the point on it.
    pub lower: Anchor,
    /// How the upper point has to move against the lower one, metres.
    pub by: Vector3<f32>,
}

/// A point on a layer.
#[derive(Debug, Clone, Copy)]
pub struct Anchor {
    /// Index of the surface.
    pub surface: usize,
    /// The vertices that carry the point.
    pub corners: [u32; 3],
    /// Its barycentric coordinates on them.
    pub weights: [f32; 3],
}

impl Anchor {
    /// The vertex that carries most of the point.
    pub fn nearest_corner(&self) -> u32 {
        let most = (0..3).max_by(|&a, &b| self.weights[a].total_cmp(&self.weights[b]));
        self.corners[most.unwrap_or(0)]
    }
}

/// Remembers how far each sample of each pair of layers is from needing a push, so that a round looks only at those
/// that may.
pub struct Contacts {
    pairs: Vec<Pair>,
}

struct Pair {
    upper: usize,
    lower: usize,
    /// Slack of the upper layer's vertices.
    vertices: Vec<f32>,
    /// Slack of the lower layer's vertices.
    lower_vertices: Vec<f32>,
}

impl Contacts {
    /// All pairs of `surfaces`, which lie inside to outside.
    pub fn new(surfaces: &[WornSurface]) -> Self {
        let count = |k: usize| surfaces[k].mesh.positions.len();
        let worn: Vec<usize> = (0..surfaces.len()).filter(|&k| count(k) > 0).collect();
        let below = |&upper: &usize| worn.iter().filter(move |&&l| l < upper).map(move |&lower| (upper, lower));
        let pairs = worn.iter().flat_map(below).map(|(upper, lower)| Pair {
            upper,
            lower,
            vertices: vec![0.0; count(upper)],
            lower_vertices: vec![0.0; count(lower)],
        });
        Self { pairs: pairs.collect() }
    }

    /// Takes the distances moved (by surface and vertex; empty where none was) off the slacks.
    pub fn moved(&mut self, surfaces: &[WornSurface], moved: &[Vec<f32>], reach: f32) {
        let all = Region { low: [f32::NEG_INFINITY; 3].into(), high: [f32::INFINITY; 3].into() };
        self.moved_in(&[all], moved, surfaces, reach);
    }

    /// As [`Contacts::moved`], where nothing moved outside some regions: what is beyond reach of all is left alone.
    pub fn moved_in(&mut self, regions: &[Region], moved: &[Vec<f32>], surfaces: &[WornSurface], reach: f32) {
        let swept = |(surface, moved): (&WornSurface, &Vec<f32>)| -> Vec<Swept> {
            let new = |r: &Region| Swept::new(&surface.mesh.positions, moved, r, reach);
            if moved.is_empty() { Vec::new() } else { regions.iter().map(new).collect() }
        };
        let swept: Vec<Vec<Swept>> = surfaces.iter().zip(moved).map(swept).collect();
        for pair in &mut self.pairs {
            let (upper, lower) = (pair.upper, pair.lower);
            let sides = [(&mut pair.vertices, upper, lower), (&mut pair.lower_vertices, lower, upper)];
            for (slacks, own, other) in sides {
                for (v, slack) in slacks.iter_mut().enumerate() {
                    let p = &surfaces[own].mesh.positions[v];
                    let of_other = swept[other].iter().map(|s| s.at(p)).fold(0.0, f32::max);
                    *slack -= moved[own].get(v).copied().unwrap_or(0.0) + of_other;
                }
            }
        }
    }

    /// All contacts of upper vertices, and of the upper points nearest to lower vertices, that lack their gap.
    pub fn samples(&mut self, surfaces: &[WornSurface], settings: &StackSettings) -> Vec<Contact> {
        let mut found = Vec::new();
        for pair in &mut self.pairs {
            let (upper, lower) = (pair.upper, pair.lower);
            let probe = |v: usize| probe_vertex(surfaces, [upper, lower], v, settings);
            look(&mut pair.vertices, probe, &mut found);
            let probe = |u: usize| probe_lower_vertex(surfaces, [upper, lower], u);
            look(&mut pair.lower_vertices, probe, &mut found);
        }
        found
    }

    /// Contacts wherever an edge of a layer passes through a triangle of another; the upper has to move by so many
    /// `gaps` along the lower one's normal.
    pub fn crossings(&self, surfaces: &[WornSurface], gaps: f32) -> Vec<Contact> {
        self.pairs.iter().flat_map(|pair| pair.crossings(surfaces, gaps)).collect()
    }
}

impl Pair {
    fn crossings(&self, surfaces: &[WornSurface], gaps: f32) -> Vec<Contact> {
        let distance = gaps * surfaces[self.upper].gap;
        crossing_contacts(surfaces, [self.upper, self.lower], &self.near(surfaces), distance)
    }

    /// Upper triangles that may cross the lower surface: one with all corners further from it than its longest side
    /// is cannot.
    fn near(&self, surfaces: &[WornSurface]) -> Vec<u32> {
        let mesh = &surfaces[self.upper].mesh;
        let may = |t: &u32| {
            let [a, b, c] = mesh.corners(*t as usize);
            let longest = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared()).sqrt();
            mesh.triangles[*t as usize].iter().any(|&v| self.vertices[v as usize] < longest)
        };
        (0..mesh.triangles.len() as u32).filter(may).collect()
    }
}

/// Pairs of triangles of surface `upper` and of any surface below that cross, exactly.
pub fn crossing_pairs(surfaces: &[WornSurface], upper: usize) -> usize {
    let u = &surfaces[upper].mesh;
    surfaces[..upper].iter().map(|l| crossings(u, &l.mesh, &l.bvh).len()).sum()
}

/// How far vertices of a surface moved, and around where.
struct Swept {
    low: Point3<f32>,
    high: Point3<f32>,
    most: f32,
}

impl Swept {
    fn new(positions: &[Point3<f32>], moved: &[f32], region: &Region, reach: f32) -> Self {
        let (mut low, mut high) = ([f32::INFINITY; 3].into(), [f32::NEG_INFINITY; 3].into());
        let mut most = 0.0f32;
        // A vertex may have left the region.
        let region = region.grown(moved.iter().copied().fold(0.0, f32::max));
        for (p, &m) in positions.iter().zip(moved).filter(|(p, m)| **m > 0.0 && region.holds(p)) {
            (low, high, most) = (p.inf(&low), p.sup(&high), most.max(m));
        }
        // Around where they are and where they were.
        let around = Vector3::repeat(reach + most);
        Self { low: low - around, high: high + around, most }
    }

    /// By how much the distance of `p` from the surface may have changed.
    fn at(&self, p: &Point3<f32>) -> f32 {
        if (0..3).all(|k| (self.low[k]..=self.high[k]).contains(&p[k])) { self.most } else { 0.0 }
    }
}

/// Probes whatever has no slack left; renews the slacks and collects the contacts in order.
fn look(slacks: &mut [f32], probe: impl Fn(usize) -> (f32, Option<Contact>) + Sync, contacts: &mut Vec<Contact>) {
    let found: Vec<Vec<Contact>> = slacks
        .par_chunks_mut(CHUNK)
        .enumerate()
        .map(|(chunk, slacks)| {
            let mut found = Vec::new();
            for (i, slack) in slacks.iter_mut().enumerate().filter(|(_, s)| **s <= 0.0) {
                let (renewed, contact) = probe(chunk * CHUNK + i);
                *slack = renewed;
                found.extend(contact);
            }
            found
        })
        .collect();
    contacts.extend(found.into_iter().flatten());
}

/// Slack of an upper vertex over a lower layer, and the contact that it makes.
fn probe_vertex(
    surfaces: &[WornSurface],
    [upper, lower]: [usize; 2],
    v: usize,
    settings: &StackSettings,
) -> (f32, Option<Contact>) {
    let on_upper = Anchor { surface: upper, corners: [v as u32; 3], weights: [1.0, 0.0, 0.0] };
    probe(surfaces, on_upper, surfaces[upper].mesh.positions[v], lower, settings.reach)
}

/// The same for the upper layer's point nearest to a lower vertex.
fn probe_lower_vertex(surfaces: &[WornSurface], [upper, lower]: [usize; 2], u: usize) -> (f32, Option<Contact>) {
    let (over, gap) = (&surfaces[upper], surfaces[upper].gap);
    let Some(hit) = over.bvh.closest(&surfaces[lower].mesh.positions[u], NEAR) else { return (NEAR - gap, None) };
    let corners = over.mesh.triangles[hit.triangle as usize];
    let on_upper = Anchor { surface: upper, corners, weights: hit.barycentric };
    probe(surfaces, on_upper, hit.point, lower, NEAR)
}

fn probe(surfaces: &[WornSurface], upper: Anchor, p: Point3<f32>, lower: usize, reach: f32) -> (f32, Option<Contact>) {
    let gap = surfaces[upper.surface].gap;
    let h = match surfaces[lower].place(&p, reach) {
        Place::Far => return (reach - gap, None),
        // Both the point and the rim may come nearer.
        Place::Beside(beside) => return (0.5 * beside, None),
        Place::Over(height) => height,
    };
    if h.value >= ENOUGH * gap {
        return (h.value - ENOUGH * gap, None);
    }
    let by = h.hit.point + h.normal * (gap * AIM) - p;
    let corners = surfaces[lower].mesh.triangles[h.hit.triangle as usize];
    let lower = Anchor { surface: lower, corners, weights: h.hit.barycentric };
    (0.0, Some(Contact { upper, lower, by }))
}

fn crossing_contacts(
    surfaces: &[WornSurface],
    [upper, lower]: [usize; 2],
    some: &[u32],
    distance: f32,
) -> Vec<Contact> {
    let (over, under) = (&surfaces[upper], &surfaces[lower]);
    let mut contacts = Vec::new();
    for [t, u] in crossings_among(&over.mesh, some, &under.mesh, &under.bvh) {
        let (x, y) = (over.mesh.corners(t as usize), under.mesh.corners(u as usize));
        let by = under.smooth_normal(u, [1.0 / 3.0; 3]) * distance;
        let on_lower = Anchor { surface: lower, corners: under.mesh.triangles[u as usize], weights: [1.0 / 3.0; 3] };
        let corners = over.mesh.triangles[t as usize];
        for k in 0..3 {
            if let Some(weights) = upper_edge_point(&x, k, &y).or_else(|| lower_edge_point(&x, k, &y)) {
                contacts.push(Contact { upper: Anchor { surface: upper, corners, weights }, lower: on_lower, by });
            }
        }
    }
    contacts
}

/// Where side k of the upper triangle passes through the lower one.
fn upper_edge_point(x: &[Point3<f32>; 3], k: usize, y: &[Point3<f32>; 3]) -> Option<[f32; 3]> {
    let (p, q) = (x[k], x[(k + 1) % 3]);
    if !segment_crosses(&p, &q, y) {
        return None;
    }
    let t = ray_hit(&p, &(q - p), y).map_or(0.5, |h| h.0.clamp(0.0, 1.0));
    let mut weights = [0.0; 3];
    (weights[k], weights[(k + 1) % 3]) = (1.0 - t, t);
    Some(weights)
}

/// Where side k of the lower triangle passes through the upper one.
fn lower_edge_point(x: &[Point3<f32>; 3], k: usize, y: &[Point3<f32>; 3]) -> Option<[f32; 3]> {
    let (p, q) = (y[k], y[(k + 1) % 3]);
    if !segment_crosses(&p, &q, x) {
        return None;
    }
    Some(ray_hit(&p, &(q - p), x).map_or([1.0 / 3.0; 3], |h| h.1))
}
