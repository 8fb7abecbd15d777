//! The fitted body between runs: `body.json`, `rest.ply` and the pose files, back as a skinned mesh.

use std::{collections::BTreeMap, path::Path};

use nalgebra::Point3;
use serde::{Deserialize, de::DeserializeOwned};
use toile_character::{
    BodyModel, Pose, Skeleton, SkinnedMesh,
    joint::{JOINT_COUNT, JOINTS},
};
use toile_geometry::ply;

use crate::{PipelineError, folders::Folders, stage};

/// What later stages need of `body.json`.
#[derive(Debug, Clone, Deserialize)]
struct Shape {
    /// Joints at rest by VRM name, metres.
    rest_joints: BTreeMap<String, [f64; 3]>,
}

/// The fitted body.
pub struct Body {
    /// The conformed body at rest with its weights.
    pub skinned: SkinnedMesh,
    /// Its pose in scan 0.
    pub pose0: Pose,
}

impl Body {
    /// Reads what the stage `fit` wrote; `layer` is the body take's folder name.
    ///
    /// # Errors
    /// [`PipelineError`] where a file is missing or not what it should be.
    pub fn load(folders: &Folders, layer: &str, model: &BodyModel) -> Result<Self, PipelineError> {
        let path = folders.body_json();
        let skeleton = skeleton(&path, &read_json(&path)?)?;
        let mut mesh = ply::read(&folders.body_rest())?;
        mesh.recompute_normals();
        let skinned = SkinnedMesh::new(mesh, skeleton, model.weights.clone())?;
        Ok(Self { skinned, pose0: read_pose(&folders.pose(layer))? })
    }
}

/// The joints as the fit left them, whatever way it found them by.
fn skeleton(path: &Path, shape: &Shape) -> Result<Skeleton, PipelineError> {
    let mut rest = [Point3::origin(); JOINT_COUNT];
    for joint in JOINTS {
        let found = shape.rest_joints.get(joint.name());
        let lacks = || PipelineError::format(path, format!("has no {}; delete it and run again", joint.name()));
        rest[joint.index()] = found.copied().map(Point3::from).ok_or_else(lacks)?;
    }
    Ok(Skeleton { rest })
}

/// Reads a pose file.
///
/// # Errors
/// [`PipelineError`] where it is missing or not what it should be.
pub fn read_pose(path: &Path) -> Result<Pose, PipelineError> {
    let pose: Pose = read_json(path)?;
    if pose.rotations.len() == JOINT_COUNT {
        return Ok(pose);
    }
    let count = pose.rotations.len();
    Err(PipelineError::format(path, format!("has {count} rotations instead of {JOINT_COUNT}; delete it and run again")))
}

/// The bytes of a pose file.
///
/// # Errors
/// [`PipelineError::Format`] where the pose holds no numbers.
pub fn pose_bytes(pose: &Pose) -> Result<Vec<u8>, PipelineError> {
    stage::pretty(pose)
}

/// Reads a JSON file of the build folder.
///
/// # Errors
/// [`PipelineError`] where it is missing or not what it should be.
pub fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T, PipelineError> {
    let bytes = std::fs::read(path).map_err(|e| PipelineError::io(path, e))?;
    serde_json::from_slice(&bytes).map_err(|e| PipelineError::format(path, format!("{e}; delete it and run again")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_is_read_back() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("pose.json");
        std::fs::write(&path, pose_bytes(&Pose::identity()).unwrap()).unwrap();
        assert_eq!(read_pose(&path).unwrap(), Pose::identity());
        std::fs::write(&path, "{\"translation\": [0, 0, 0], \"rotations\": []}").unwrap();
        assert!(read_pose(&path).unwrap_err().to_string().contains("0 rotations"));
    }
}
