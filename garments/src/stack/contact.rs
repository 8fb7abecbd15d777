//! Points of two layers that come too near to one another, and how they have to move apart.

use nalgebra::{Point3, Vector3};
use toile_geometry::{
    intersection::{crossings, segment_crosses},
    open_surface::Against,
    triangle::ray_hit,
};

use super::layer::Layer;

/// Pushes aim this much beyond the gap, so that rounds end.
const AIM: f32 = 1.15;
/// Heights under this share of the gap are pushed.
const ENOUGH: f32 = 0.8;

/// Two points, one on each of two layers, that have to move apart.
#[derive(Debug, Clone, Copy)]
pub(super) struct Contact {
    /// The outer layer and the point on it.
    pub upper: Anchor,
    /// The layer below and the point on it.
    pub lower: Anchor,
    /// How the upper point has to move against the lower one, metres.
    pub by: Vector3<f32>,
}

/// A point on a layer.
#[derive(Debug, Clone, Copy)]
pub(super) struct Anchor {
    /// Index of the layer.
    pub layer: usize,
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

/// How much the point `p` of an upper layer may move before it can lack its gap over layer `lower` (metres), and the
/// contact where it lacks it already.
pub(super) fn probe(
    layers: &[Layer],
    upper: Anchor,
    p: &Point3<f32>,
    lower: usize,
    reach: f32,
) -> (f32, Option<Contact>) {
    let (gap, below) = (layers[upper.layer].gap, &layers[lower].surface);
    let h = match below.locate(p, reach) {
        Against::Far => return (reach - gap, None),
        // Both the point and the rim may come nearer.
        Against::Beside(beside) => return (0.5 * beside, None),
        Against::Over(height) => height,
    };
    if h.value >= ENOUGH * gap {
        return (h.value - ENOUGH * gap, None);
    }
    let by = h.hit.point + h.normal * (gap * AIM) - p;
    let corners = below.mesh.triangles[h.hit.triangle as usize];
    let lower = Anchor { layer: lower, corners, weights: h.hit.barycentric };
    (0.0, Some(Contact { upper, lower, by }))
}

/// Contacts wherever an edge of one layer passes through a triangle of the other; the upper has to move by `distance` metres
/// along the lower one's normal.
pub(super) fn crossing_contacts(layers: &[Layer], [upper, lower]: [usize; 2], distance: f32) -> Vec<Contact> {
    let (over, under) = (&layers[upper].surface, &layers[lower].surface);
    let mut contacts = Vec::new();
    for [t, u] in crossings(&over.mesh, &over.bvh, &under.mesh, &under.bvh) {
        let (x, y) = (over.mesh.corners(t as usize), under.mesh.corners(u as usize));
        let by = under.smooth_normal(u, [1.0 / 3.0; 3]) * distance;
        let lower = Anchor { layer: lower, corners: under.mesh.triangles[u as usize], weights: [1.0 / 3.0; 3] };
        let corners = over.mesh.triangles[t as usize];
        let weights = (0..3).filter_map(|k| upper_edge_point(&x, k, &y).or_else(|| lower_edge_point(&x, k, &y)));
        contacts.extend(weights.map(|weights| Contact { upper: Anchor { layer: upper, corners, weights }, lower, by }));
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
    segment_crosses(&p, &q, x).then(|| ray_hit(&p, &(q - p), x).map_or([1.0 / 3.0; 3], |h| h.1))
}
