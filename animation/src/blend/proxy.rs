//! The sheet that is simulated in place of a garment's mesh.

use nalgebra::{Point3, Vector3};
use toile_character::{FREE_PART, SkinWeights, Skinner};
use toile_cloth::{Anchors, RestShape, Sheet};
use toile_geometry::{Mesh, bvh::Bvh, remesh};

use super::{
    anchors::{Closeness, Over, frequency},
    hung::Hung,
    layer::OutfitLayer,
    ride::Ride,
    shares::Shares,
};
use crate::AnimationError;

/// Vertices that a proxy aims at: edges of some 15 mm on a pair of trousers.
const VERTICES: f64 = 4000.0;
/// Shortest edge of a proxy, metres: finer than the folds that a sensor resolves gains nothing.
const SHORTEST_EDGE: f64 = 0.010;
/// Distance that a proxy's vertices keep from surfaces, metres, where the scan had as much.
const GAP: f64 = 0.002;

/// The sheet that is simulated in place of a garment's mesh, at rest.
pub(crate) struct Proxy {
    pub sheet: Sheet,
    pub skinner: Skinner,
    pub over: Vec<Over>,
    /// Distance that each vertex keeps from surfaces, metres.
    pub gaps: Vec<f64>,
    /// How tightly each vertex is tied to its skinned place: 1 on the skin, 0 where it hangs free.
    pub tied: Vec<f64>,
    pub ride: Ride,
    /// The same sheet without ties, as the seed simulates it.
    pub hung: Hung,
    pub shares: Shares,
}

impl Proxy {
    pub fn new(layer: &OutfitLayer, closeness: &Closeness) -> Result<Self, AnimationError> {
        let wrong = |reason: String| AnimationError::Motion(format!("layer {}: {reason}", layer.name));
        // An equilateral triangle of edge e has an area of 0.433 e², and there are two a vertex.
        let edge = (layer.mesh.area() / (2.0 * VERTICES * 0.433)).sqrt().max(SHORTEST_EDGE);
        let mesh = remesh::isotropic(&layer.mesh, edge as f32);
        let (weights, free) = carried_over(&layer.mesh, &layer.weights, &mesh);
        let over: Option<Vec<Over>> =
            mesh.positions.iter().zip(&free).map(|(p, free)| closeness.over(p, *free as f32)).collect();
        let over = over.ok_or_else(|| wrong("there is no body below it".into()))?;
        let distance = |v: usize| f64::from(over[v].height).max(0.0);
        let frequencies: Vec<f64> = (0..over.len()).map(|v| frequency(distance(v), free[v])).collect();
        let rest: Vec<Point3<f64>> = mesh.positions.iter().map(|p| p.cast()).collect();
        let shape = RestShape { positions: &rest, triangles: &mesh.triangles, curved: true, grain: Vector3::y() };
        let new = |anchors| Sheet::new(&shape, layer.fabric, anchors);
        let loose = new(Anchors::default()).map_err(|e| wrong(e.to_string()))?;
        let stiffness = loose.masses().iter().zip(&frequencies).map(|(m, w)| m * w * w).collect();
        let sheet = loose.tied_by(stiffness).map_err(|e| wrong(e.to_string()))?;
        let hung = Hung::new(&loose, &mesh, &weights)?;
        let tied = frequencies.iter().map(|w| (w / frequency(0.0, 0.0)).powi(2)).collect();
        let gaps = (0..over.len()).map(|v| distance(v).min(GAP)).collect();
        let skinner = Skinner::new(&mesh, &weights).map_err(|e| wrong(e.to_string()))?;
        let ride = Ride::new(&layer.mesh, &mesh);
        let shares = Shares::new(&layer.mesh, closeness);
        Ok(Self { sheet, skinner, over, gaps, tied, ride, hung, shares })
    }
}

/// Skin weights, and how far the cloth hangs free, from the nearest places of `fine`.
pub(crate) fn carried_over(fine: &Mesh, weights: &SkinWeights, coarse: &Mesh) -> (SkinWeights, Vec<f64>) {
    let bvh = Bvh::new(&fine.positions, &fine.triangles);
    let of_part = fine.attributes.get(FREE_PART);
    let (mut out, mut free) = (SkinWeights::default(), Vec::with_capacity(coarse.positions.len()));
    for p in &coarse.positions {
        let Some(hit) = bvh.closest(p, f32::INFINITY) else { continue };
        let corners = fine.triangles[hit.triangle as usize];
        out.push_interpolated(weights, corners, hit.barycentric);
        let part = |values: &Vec<f32>| -> f32 {
            corners.iter().zip(hit.barycentric).map(|(&v, w)| values[v as usize] * w).sum()
        };
        free.push(f64::from(of_part.map_or(0.0, part)));
    }
    (out, free)
}
