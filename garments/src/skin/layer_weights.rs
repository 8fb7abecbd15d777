//! Layers that lie close over one another move alike: an outer layer takes the weights of the layer below it where it
//! is near, so that layers that do not cross in one pose rarely cross in another.

use nalgebra::Vector3;
use rayon::prelude::*;
use toile_character::{FREE_PART, Pose, Skeleton, SkinWeights};
use toile_geometry::{Mesh, bvh::Bvh};

use super::{
    influences::{Row, row, smoothed, to_weights},
    limit_stretch::limit_stretch,
};
use crate::error::GarmentError;

/// Nearer than the first a vertex has the weights of the layer below; further than the second its own; metres.
const NEAR: [f32; 2] = [0.015, 0.03];
/// The mixture is smoothed over this length, metres.
const SMOOTHING: f32 = 0.008;
/// Surfaces face alike up to this angle (cosine).
const MIN_COSINE: f32 = 0.3;

/// Gives each of the `layers` (inside to outside, stacked in `pose0`, with their `weights`) the weights of the nearest
/// layer below where that is close. Layers over bare body keep their own weights, and so does what hangs free
/// ([`FREE_PART`]), as far as it can bear a stride: see `limit_stretch`.
///
/// # Errors
/// [`GarmentError::Mismatch`] where a layer does not have as many weights as vertices.
pub fn carry_weights(
    layers: &[Mesh],
    weights: &mut [SkinWeights],
    skeleton: &Skeleton,
    pose0: &Pose,
) -> Result<(), GarmentError> {
    if let Some((mesh, w)) = layers.iter().zip(weights.iter()).find(|(m, w)| m.positions.len() != w.len()) {
        let reason = format!("a layer has {} vertices but weights for {}", mesh.positions.len(), w.len());
        return Err(GarmentError::Mismatch(reason));
    }
    for (k, layer) in layers.iter().enumerate().take(weights.len()) {
        let (below, rest) = weights.split_at_mut(k);
        let lowers: Vec<Lower> = layers[..k].iter().zip(below.iter()).map(|(m, w)| Lower::new(m, w)).collect();
        rest[0] = carried(layer, &rest[0], &lowers);
        limit_stretch(layer, &mut rest[0], skeleton, pose0);
    }
    Ok(())
}

struct Lower<'a> {
    mesh: &'a Mesh,
    weights: &'a SkinWeights,
    bvh: Bvh,
    normals: Vec<Vector3<f32>>,
}

impl<'a> Lower<'a> {
    fn new(mesh: &'a Mesh, weights: &'a SkinWeights) -> Self {
        let bvh = Bvh::new(&mesh.positions, &mesh.triangles);
        Self { mesh, weights, bvh, normals: mesh.triangle_normals() }
    }
}

fn carried(upper: &Mesh, own: &SkinWeights, lowers: &[Lower]) -> SkinWeights {
    let normals = upper.vertex_normals();
    let free = upper.attributes.get(FREE_PART);
    let close = |v: usize| free.is_none_or(|f| f[v] < 0.5);
    let mix = |v: usize| close(v).then(|| mixed(upper, &normals, own, lowers, v)).flatten();
    let rows: Vec<Option<Row>> = (0..own.len()).into_par_iter().map(mix).collect();
    if rows.iter().all(Option::is_none) {
        return own.clone();
    }
    let rows = rows.into_iter().enumerate().map(|(v, mixed)| mixed.unwrap_or_else(|| row(own, v))).collect();
    to_weights(&smoothed(upper, rows, &vec![SMOOTHING; own.len()]))
}

/// Weights of vertex `v` mixed with those of the nearest layer below that faces alike; `None` where none is near.
fn mixed(upper: &Mesh, normals: &[Vector3<f32>], own: &SkinWeights, lowers: &[Lower], v: usize) -> Option<Row> {
    let near = |lower: &Lower| {
        let is_alike = |t: u32| lower.normals[t as usize].dot(&normals[v]) > MIN_COSINE;
        lower.bvh.closest_where(&upper.positions[v], NEAR[1], is_alike)
    };
    let hits = lowers.iter().filter_map(|lower| Some((lower, near(lower)?)));
    let (lower, hit) = hits.min_by(|a, b| a.1.distance.total_cmp(&b.1.distance))?;
    let share = ((NEAR[1] - hit.distance) / (NEAR[1] - NEAR[0])).clamp(0.0, 1.0);
    let mut row = row(own, v).map(|w| w * (1.0 - share));
    for (corner, b) in lower.mesh.triangles[hit.triangle as usize].into_iter().zip(hit.barycentric) {
        lower.weights.of(corner as usize).for_each(|(j, w)| row[j as usize] += w * b * share);
    }
    Some(row)
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;
    use toile_character::JOINT_COUNT;

    use super::*;

    fn skeleton() -> Skeleton {
        Skeleton { rest: [Point3::origin(); JOINT_COUNT] }
    }

    /// A sheet of 20 × 20 squares of 10 mm at height `z`, all on one joint.
    fn sheet(z: f32, joint: u8) -> (Mesh, SkinWeights) {
        let n = 21u32;
        let at = |i: u32| Point3::new((i % n) as f32 * 0.01, (i / n) as f32 * 0.01, z);
        let triangles = (0..n - 1)
            .flat_map(|j| (0..n - 1).map(move |i| j * n + i))
            .flat_map(|a| [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]])
            .collect();
        let mesh = Mesh::new((0..n * n).map(at).collect(), triangles);
        let mut weights = SkinWeights::default();
        (0..n * n).for_each(|_| weights.push(&[(joint, 1.0)]));
        (mesh, weights)
    }

    #[test]
    fn what_is_near_takes_the_weights_below_and_what_is_far_keeps_its_own() {
        for (z, expected) in [(0.01, 1), (0.2, 2)] {
            let ((a, wa), (b, wb)) = (sheet(0.0, 1), sheet(z, 2));
            let mut weights = [wa.clone(), wb];
            carry_weights(&[a, b], &mut weights, &skeleton(), &Pose::identity()).unwrap();
            assert_eq!(weights[0], wa);
            assert!(weights[1].joints.iter().all(|j| j[0] == expected), "{z}");
        }
    }

    #[test]
    fn weights_of_another_mesh_are_refused() {
        let (mesh, _) = sheet(0.0, 1);
        let refused = carry_weights(&[mesh], &mut [SkinWeights::default()], &skeleton(), &Pose::identity());
        assert!(matches!(refused, Err(GarmentError::Mismatch(_))));
    }
}
