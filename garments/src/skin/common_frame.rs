//! From a take's pose to the common frame: weights carried from the body, un-posed and posed again.

use rayon::prelude::*;
use toile_character::{FREE_PART, SkinWeights, joint::JOINT_COUNT, skinning};
use toile_geometry::{Mesh, bvh::Bvh};

use super::influences::{smoothed, to_weights};
use crate::{settings::ExtractSettings, take::DressedTake};

/// Weights are smoothed over at least this length, metres: the body's own triangles are not finer.
const MIN_SMOOTHING: f32 = 0.01;
/// Cloth at distance d from the body shares its weights with cloth within this many times d.
const SMOOTHING_PER_DISTANCE: f32 = 1.5;
/// Weights are smoothed over at least this length where a garment hangs free ([`FREE_PART`]), metres: both legs carry a skirt.
const FREE_SMOOTHING: f32 = 0.08;

/// Skin weights of a garment in a take: those of the closest body triangle that faces the same way (seed §5.2), then
/// smoothed over the garment, the more the looser it hangs, so that a skirt does not tear between the legs.
pub fn weights(take: &DressedTake, garment: &Mesh, settings: &ExtractSettings) -> SkinWeights {
    if garment.is_empty() {
        return SkinWeights::default();
    }
    let (closest, distances) = closest_weights(take, garment);
    let free = garment.attributes.get(FREE_PART);
    let least = |v: usize| if free.is_some_and(|f| f[v] > 0.5) { FREE_SMOOTHING } else { MIN_SMOOTHING };
    let loose = |d: f32| SMOOTHING_PER_DISTANCE * d * (d / settings.loose_distance.max(1e-4)).min(1.0);
    let lengths: Vec<f32> = distances.iter().enumerate().map(|(v, &d)| least(v).max(loose(d))).collect();
    to_weights(&smoothed(garment, closest, &lengths))
}

/// Dense weights of the closest compatible body triangle, and the distance to it.
fn closest_weights(take: &DressedTake, garment: &Mesh) -> (Vec<[f32; JOINT_COUNT]>, Vec<f32>) {
    let bvh = Bvh::new(&take.body.positions, &take.body.triangles);
    let normals = take.body.triangle_normals();
    let own = garment.vertex_normals();
    garment
        .positions
        .par_iter()
        .zip(&own)
        .map(|(p, n)| {
            let mut row = [0.0; JOINT_COUNT];
            let is_alike = |t: u32| normals[t as usize].dot(n) > 0.0;
            let Some(hit) = bvh.closest_where(p, f32::INFINITY, is_alike).or_else(|| bvh.closest(p, f32::INFINITY))
            else {
                return (row, 0.0);
            };
            for (v, b) in take.body.triangles[hit.triangle as usize].into_iter().zip(hit.barycentric) {
                take.weights.of(v as usize).for_each(|(j, w)| row[j as usize] += w * b);
            }
            (row, hit.distance)
        })
        .unzip()
}

/// The garment's vertices un-posed from the take's pose and posed as in take 0 (Hu et al. 2017, §6.3).
pub fn to_common_frame(take: &DressedTake, garment: &Mesh, weights: &SkinWeights) -> Mesh {
    let rest = skinning::unskin(&garment.positions, weights, &take.pose.skinning_transforms(take.skeleton));
    let mut common = garment.clone();
    common.positions = skinning::skin(&rest, weights, &take.pose0.skinning_transforms(take.skeleton));
    common.recompute_normals();
    common
}
