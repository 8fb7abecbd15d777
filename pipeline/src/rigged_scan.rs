//! A scan with skeleton and weights as a file.

use std::path::Path;

use toile_avatar::{Avatar, AvatarLayer, write_glb};
use toile_character::{JointNaming, Pose, Skeleton, SkinWeights};
use toile_geometry::Mesh;

use crate::PipelineError;

/// Scan 0 with skeleton and weights as a GLB file.
///
/// # Errors
/// [`PipelineError`] where the scan cannot be weighted.
pub fn rigged_scan(
    scan: &Mesh,
    weights: &SkinWeights,
    skeleton: &Skeleton,
    pose: &Pose,
) -> Result<Vec<u8>, PipelineError> {
    let layer = AvatarLayer {
        name: "scan".into(),
        mesh: scan.clone(),
        weights: weights.clone(),
        order: 0,
        garment: None,
        thickness: None,
        texture: None,
    };
    let avatar = Avatar {
        name: "rigged scan".into(),
        skeleton: skeleton.clone(),
        joint_names: JointNaming::Vrm,
        pose0: pose.clone(),
        layers: vec![layer],
        motions: Vec::new(),
    };
    write_glb(&avatar).map_err(|e| PipelineError::stage(Path::new("rigged_scan.glb"), e))
}
