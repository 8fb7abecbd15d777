//! Garments of a body whose shape changed: they go along with the skin around them.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_geometry::{Mesh, areas::vertex_areas};

use crate::GarmentError;

/// Skin nearer than this counts alike, metres: a garment at rest on the skin takes the mean movement of that much of it, so that
/// detail of the skin does not print through.
const NEAR: f32 = 0.02;

/// Moves `layers`, worn by `body`, as its skin moves to `positions` (the same vertices, the same pose, metres).
///
/// Each point moves by the mean movement of all skin, weighted by area and the inverse fourth power of distance: the field is smooth
/// and the same for all layers, so that what lay over something still does, and far from the skin it varies less. Normals are recomputed.
///
/// # Errors
/// [`GarmentError::Mismatch`] where `positions` are not as many as the body has vertices.
pub fn follow(body: &Mesh, positions: &[Point3<f32>], layers: &mut [Mesh]) -> Result<(), GarmentError> {
    if positions.len() != body.positions.len() {
        let (have, want) = (positions.len(), body.positions.len());
        return Err(GarmentError::Mismatch(format!("the new body has {have} vertices, the old one {want}")));
    }
    let areas = vertex_areas(body);
    let moves = body.positions.iter().zip(positions).zip(areas);
    let skin: Vec<(Point3<f32>, Vector3<f32>, f32)> =
        moves.filter(|(_, area)| *area > 0.0).map(|((from, to), area)| (*from, to - from, area)).collect();
    for layer in layers {
        layer.positions.par_iter_mut().for_each(|p| *p += movement(p, &skin));
        layer.recompute_normals();
    }
    Ok(())
}

/// The movement of the place `p`.
fn movement(p: &Point3<f32>, skin: &[(Point3<f32>, Vector3<f32>, f32)]) -> Vector3<f32> {
    let (mut sum, mut total) = (Vector3::zeros(), 0.0f32);
    for (from, moved, area) in skin {
        let near = (p - from).norm_squared() + NEAR * NEAR;
        let weight = area / (near * near);
        sum += moved * weight;
        total += weight;
    }
    if total > 0.0 { sum / total } else { Vector3::zeros() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A closed tube about +Y.
    fn tube(radius: f32) -> Mesh {
        const SIDES: u32 = 32;
        const RINGS: u32 = 21;
        let at = |k: u32| {
            let angle = std::f32::consts::TAU * (k % SIDES) as f32 / SIDES as f32;
            Point3::new(radius * angle.sin(), 0.02 * (k / SIDES) as f32, radius * angle.cos())
        };
        let quad = |k: u32| {
            let next = k / SIDES * SIDES + (k + 1) % SIDES;
            [[k, next, k + SIDES], [next, next + SIDES, k + SIDES]]
        };
        Mesh::new((0..SIDES * RINGS).map(at).collect(), (0..SIDES * (RINGS - 1)).flat_map(quad).collect())
    }

    fn radii(mesh: &Mesh) -> (f32, f32) {
        let radius = |p: &Point3<f32>| p.x.hypot(p.z);
        let middle = mesh.positions.iter().filter(|p| (0.1..0.3).contains(&p.y)).map(radius);
        middle.fold((f32::MAX, 0.0), |(low, high), r| (low.min(r), high.max(r)))
    }

    #[test]
    fn layers_of_a_tube_that_widens_and_rises_stay_over_it_in_their_order() {
        let (body, mut layers) = (tube(0.1), [tube(0.11), tube(0.12)]);
        let wider: Vec<Point3<f32>> =
            body.positions.iter().map(|p| Point3::new(1.3 * p.x, p.y + 0.05, 1.3 * p.z)).collect();
        follow(&body, &wider, &mut layers).unwrap();
        let (inner, outer) = (radii(&layers[0]), radii(&layers[1]));
        assert!(inner.0 > 0.13 && inner.1 < outer.0 && outer.1 < 0.155, "{inner:?} {outer:?}");
        let rise = layers[0].positions[0].y - tube(0.11).positions[0].y;
        assert!((rise - 0.05).abs() < 1e-4, "{rise}");
        assert!(follow(&body, &wider[1..], &mut layers).is_err());
    }
}
