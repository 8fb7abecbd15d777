//! From a take's pose to the common frame: weights carried from the body, un-posed and posed again.

use nalgebra::Vector3;
use rayon::prelude::*;
use toile_character::{SkinWeights, joint::JOINT_COUNT, skin::INFLUENCES, skinning};
use toile_geometry::{Mesh, bvh::Bvh};

use crate::{ExtractSettings, Take, hanging::FREE_PART, surface_solve::SurfaceSystem};

/// Weights are smoothed over at least this length, metres: the body's own triangles are no finer.
const LEAST_SMOOTHING: f32 = 0.01;
/// Cloth at distance d from the body shares its weights with what lies within this many times d.
const SMOOTHING_PER_DISTANCE: f32 = 1.5;

/// Least smoothing of weights where a garment hangs free ([`FREE_PART`]), metres: both legs carry a skirt.
const FREE_SMOOTHING: f32 = 0.08;

/// Skin weights of a garment in a take: those of the closest body triangle that faces the same way (seed §5.2), then
/// spread over the garment the further the looser it hangs, so that a skirt does not tear between the legs.
pub fn weights(take: &Take, garment: &Mesh, settings: &ExtractSettings) -> SkinWeights {
    if garment.is_empty() {
        return SkinWeights::default();
    }
    let (mut closest, distances) = closest_weights(take, garment);
    let free = garment.attributes.get(FREE_PART);
    let least = |v: usize| if free.is_some_and(|f| f[v] > 0.5) { FREE_SMOOTHING } else { LEAST_SMOOTHING };
    let loose = |d: f32| SMOOTHING_PER_DISTANCE * d * (d / settings.loose_distance.max(1e-4)).min(1.0);
    let lengths: Vec<f32> = distances.iter().enumerate().map(|(v, &d)| least(v).max(loose(d))).collect();
    let system = SurfaceSystem::new(garment);
    let anchors: Vec<f32> = lengths.iter().map(|l| 1.0 / (l * l)).collect();
    let used: Vec<usize> = (0..JOINT_COUNT).filter(|&j| closest.iter().any(|row| row[j] > 0.0)).collect();
    let columns: Vec<(usize, Vec<f32>)> = used
        .into_par_iter()
        .map(|j| {
            let column: Vec<f32> = closest.iter().map(|row| row[j]).collect();
            (j, system.smoothed(&column, &anchors))
        })
        .collect();
    for (j, column) in columns {
        closest.iter_mut().zip(column).for_each(|(row, w)| row[j] = w);
    }
    let mut out = SkinWeights::default();
    for row in closest {
        push_continuous(&mut out, row.into_iter().enumerate().map(|(j, w)| (j as u8, w)));
    }
    out
}

/// Adds a vertex with at most [`INFLUENCES`] of its `influences` (joint, weight; each joint once). The largest that is
/// dropped is subtracted from those that stay: where two neighbours keep different joints, these then weigh next to
/// nothing. Cut off plainly, a shin that weighs 0.016 on every other vertex stretches a hem's triangles threefold.
pub(crate) fn push_continuous(out: &mut SkinWeights, influences: impl Iterator<Item = (u8, f32)>) {
    let mut sorted: Vec<(u8, f32)> = influences.filter(|i| i.1 > 0.0).collect();
    sorted.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let dropped = sorted.get(INFLUENCES).map_or(0.0, |i| i.1);
    let kept: Vec<(u8, f32)> = sorted.iter().take(INFLUENCES).map(|&(j, w)| (j, w - dropped)).collect();
    // As many equal ones as that are no use to choose by: then the plain rule.
    out.push(if kept.iter().any(|i| i.1 > 0.0) { &kept } else { &sorted });
}

/// Dense weights of the closest compatible body triangle, and the distance to it.
fn closest_weights(take: &Take, garment: &Mesh) -> (Vec<[f32; JOINT_COUNT]>, Vec<f32>) {
    let bvh = Bvh::new(&take.body.positions, &take.body.triangles);
    let normals = take.body.triangle_normals();
    let own = garment.vertex_normals();
    garment
        .positions
        .par_iter()
        .zip(&own)
        .map(|(p, n)| {
            let mut row = [0.0; JOINT_COUNT];
            let facing = |t: u32| facing(&normals[t as usize], n);
            let Some(hit) = bvh.closest_where(p, f32::INFINITY, facing).or_else(|| bvh.closest(p, f32::INFINITY))
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

fn facing(body: &Vector3<f32>, garment: &Vector3<f32>) -> bool {
    body.dot(garment) > 0.0
}

/// The garment's vertices un-posed from the take's pose and posed as in take 0 (Hu et al. 2017, §6.3).
pub fn to_common_frame(take: &Take, garment: &Mesh, weights: &SkinWeights) -> Mesh {
    let rest = skinning::unskin(&garment.positions, weights, &take.pose.skinning_transforms(take.skeleton));
    let mut common = garment.clone();
    common.positions = skinning::skin(&rest, weights, &take.pose0.skinning_transforms(take.skeleton));
    common.recompute_normals();
    common
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_change_of_weights_changes_little_though_other_joints_are_kept() {
        let kept = |fourth: f32, fifth: f32| {
            let mut out = SkinWeights::default();
            push_continuous(
                &mut out,
                [0.6, 0.2, 0.168, fourth, fifth].into_iter().enumerate().map(|(j, w)| (j as u8, w)),
            );
            let mut row = [0.0; JOINT_COUNT];
            out.of(0).for_each(|(j, w)| row[j as usize] += w);
            assert!((row.iter().sum::<f32>() - 1.0).abs() < 1e-5);
            row
        };
        let (a, b) = (kept(0.0161, 0.0159), kept(0.0159, 0.0161));
        let change = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(change < 5e-4, "{change}");
        // Nothing is dropped, nothing changes; and equal ones are no trouble.
        assert!((kept(0.032, 0.0)[3] - 0.032).abs() < 1e-6);
        let mut out = SkinWeights::default();
        push_continuous(&mut out, (0..8).map(|j| (j, 0.125)));
        assert_eq!(out.of(0).collect::<Vec<_>>(), [(0, 0.25), (1, 0.25), (2, 0.25), (3, 0.25)]);
    }
}
