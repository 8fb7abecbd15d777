//! The motion as a GLB that any player of glTF shows: layers hang on helper joints that follow the caches.

use std::path::Path;

use nalgebra::{Isometry3, Point3};
use toile_animation::decomposition::{DecompositionSettings, LayerMotion, decompose, sample_frames};
use toile_avatar::{Avatar, HelperJoints, write_glb_with_helpers};
use toile_character::{Motion, Pose};

use super::caches::Cached;
use crate::PipelineError;

/// The avatar in `motion` as a GLB, its layers on helper joints found from what `cached` says they do.
pub(super) fn glb(
    avatar: &Avatar,
    motion: &Motion,
    cached: &mut [Cached],
    folder: &Path,
) -> Result<Vec<u8>, PipelineError> {
    let wrong = |e: &dyn std::fmt::Display| PipelineError::refused(folder, format!("motion.glb: {e}"));
    let moved = |pose: &Pose| pose.transforms_from(&avatar.pose0, &avatar.skeleton);
    let mut hung = Avatar { motions: vec![motion.clone()], ..avatar.clone() };
    let kept = sample_frames(motion.poses.len());
    let joints: Vec<Vec<Isometry3<f64>>> = kept.iter().map(|&f| moved(&motion.poses[f])).collect();
    let frames = cached
        .iter_mut()
        .map(|layer| kept.iter().map(|&f| layer.frame(f)).collect::<Result<Vec<Vec<Point3<f32>>>, _>>())
        .collect::<Result<Vec<_>, _>>()?;
    let layers: Vec<LayerMotion> = hung
        .layers
        .iter()
        .zip(&frames)
        .map(|(l, frames)| LayerMotion { rest: &l.mesh.positions, weights: &l.weights, frames })
        .collect();
    let found = decompose(&layers, &joints, &DecompositionSettings::default()).map_err(|e| wrong(&e))?;
    drop(frames);
    let mut helpers = HelperJoints { frames: vec![Vec::new(); motion.poses.len()], ..HelperJoints::default() };
    for (layer, avatar_layer) in found.iter().zip(&hung.layers) {
        for (h, center) in layer.centers.iter().enumerate() {
            helpers.names.push(format!("{} helper {}", avatar_layer.name, h + 1));
            helpers.centers.push(*center);
        }
    }
    for (f, pose) in motion.poses.iter().enumerate() {
        let joints = moved(pose);
        for (layer, cached) in found.iter().zip(&mut *cached).filter(|(l, _)| !l.centers.is_empty()) {
            let solved = layer.solve(&joints, &cached.frame(f)?).map_err(|e| wrong(&e))?;
            helpers.frames[f].extend(solved.iter().map(|t| t.cast::<f32>()));
        }
    }
    for (layer, found) in hung.layers.iter_mut().zip(found) {
        layer.weights = found.weights;
    }
    write_glb_with_helpers(&hung, &helpers).map_err(|e| wrong(&e))
}
