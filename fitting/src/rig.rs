//! Skin weights of the body carried onto a scan (Hu et al. 2017, §5.2).

use nalgebra::Vector3;
use rayon::prelude::*;
use toile_character::{Pose, SkinWeights, SkinnedMesh, skinning};
use toile_geometry::{Mesh, bvh::Bvh, topology::VertexNeighbors};

/// Smallest cosine between the normals of scan and body: keeps an arm from moving with the torso that it touches.
const MIN_COS: f32 = 0.2;
/// Beyond this distance the nearest triangle counts whatever its normal, metres.
const REACH: f32 = 0.08;

/// Weights for every scan vertex: the closest compatible triangle of the posed body, by barycentric coordinates, then
/// averaged once with the neighbours, so that neighbouring vertices which chose different parts leave no seam.
///
/// `scan` must lie in the frame of `body.posed(pose)`. With a body without triangles, all vertices follow joint 0.
pub fn rig_scan(scan: &Mesh, body: &SkinnedMesh, pose: &Pose) -> SkinWeights {
    let posed = body.posed_mesh(pose);
    let bvh = Bvh::new(&posed.positions, &posed.triangles);
    let triangle_normals = posed.triangle_normals();
    let normals = if scan.normals.is_empty() { scan.vertex_normals() } else { scan.normals.clone() };
    let hits: Vec<_> = (0..scan.positions.len())
        .into_par_iter()
        .with_min_len(128)
        .map(|v| {
            let p = &scan.positions[v];
            let fits =
                |t: u32| normals[v] == Vector3::zeros() || triangle_normals[t as usize].dot(&normals[v]) > MIN_COS;
            bvh.closest_where(p, REACH, fits).or_else(|| bvh.closest(p, f32::INFINITY))
        })
        .collect();
    let mut weights = SkinWeights::default();
    for hit in hits {
        match hit {
            Some(h) => weights.push_interpolated(&body.weights, posed.triangles[h.triangle as usize], h.barycentric),
            None => weights.push(&[]),
        }
    }
    smoothed(scan, &weights)
}

/// Averages each vertex's own weights with its neighbours' mean.
fn smoothed(scan: &Mesh, weights: &SkinWeights) -> SkinWeights {
    let neighbors = VertexNeighbors::new(scan.positions.len(), &scan.triangles);
    let mut out = SkinWeights::default();
    for v in 0..weights.len() {
        let around = neighbors.of(v);
        let mut influences: Vec<(u8, f32)> = weights.of(v).collect();
        let share = 1.0 / around.len().max(1) as f32;
        influences.extend(around.iter().flat_map(|&n| weights.of(n as usize).map(|(j, w)| (j, w * share))));
        out.push(&influences);
    }
    out
}

/// The scan as a skinned mesh: un-posed from `pose` to the body's rest, with weights by [`rig_scan`].
pub fn rigged_scan(scan: &Mesh, body: &SkinnedMesh, pose: &Pose) -> SkinnedMesh {
    let weights = rig_scan(scan, body, pose);
    let transforms = pose.skinning_transforms(&body.skeleton);
    let mut mesh = scan.clone();
    mesh.positions = skinning::unskin(&scan.positions, &weights, &transforms);
    mesh.recompute_normals();
    SkinnedMesh { mesh, skeleton: body.skeleton.clone(), weights }
}
