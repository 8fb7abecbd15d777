//! The fitted body between runs: `body.json`, `rest.ply` and the pose files, back as a skinned mesh.

use std::{collections::BTreeMap, path::Path};

use nalgebra::Point3;
use serde::Deserialize;
use toile_character::{
    BodyModel, Pose, Skeleton, SkinnedMesh,
    joint::{JOINT_COUNT, JOINTS},
};
use toile_fitting::ScanLandmark;
use toile_geometry::ply;

use crate::{PipelineError, folders::Folders, json};

/// The part of `body.json` that later steps and the page need.
#[derive(Debug, Clone, Deserialize)]
pub struct BodyFile {
    /// Standing straight, metres.
    pub stature_m: f64,
    /// Girths by name, metres.
    pub girths_m: BTreeMap<String, f64>,
    /// Where the girths were taken.
    pub girths: BTreeMap<String, GirthHeight>,
    /// Cubic metres.
    pub volume_m3: f64,
    /// Joints at rest by VRM name, metres.
    pub rest_joints: BTreeMap<String, [f64; 3]>,
    /// Landmarks on the scan, in its frame.
    pub landmarks: Vec<ScanLandmark>,
}

/// Height of a girth above the soles.
#[derive(Debug, Clone, Deserialize)]
pub struct GirthHeight {
    /// Metres.
    pub height_m: f64,
}

/// The fitted body.
pub struct Body {
    /// The conformed body at rest with its weights.
    pub skinned: SkinnedMesh,
    /// Its pose in scan 0.
    pub pose0: Pose,
}

impl Body {
    /// Reads what the step `fit` wrote; `layer` is the body take's folder name.
    ///
    /// # Errors
    /// [`PipelineError`] where a file is missing or not what it should be.
    pub fn load(folders: &Folders, layer: &str, model: &BodyModel) -> Result<Self, PipelineError> {
        let path = folders.body_json();
        let found: BodyFile = json::read(&path)?;
        let skeleton = skeleton(&path, &found.rest_joints)?;
        let mut mesh = ply::read(&folders.body_rest())?;
        mesh.recompute_normals();
        let skinned = SkinnedMesh::new(mesh, skeleton, model.weights.clone())?;
        Ok(Self { skinned, pose0: read_pose(&folders.pose(layer))? })
    }
}

/// The joints as the fit left them, whatever way it found them by: `rest_joints` of the file `path`, by VRM name.
///
/// # Errors
/// [`PipelineError`] where one is missing.
pub fn skeleton(path: &Path, rest_joints: &BTreeMap<String, [f64; 3]>) -> Result<Skeleton, PipelineError> {
    let mut rest = [Point3::origin(); JOINT_COUNT];
    for joint in JOINTS {
        let found = rest_joints.get(joint.name());
        let lacks = || PipelineError::field(path, "rest_joints", format!("`{}` is missing", joint.name()));
        rest[joint.index()] = found.copied().map(Point3::from).ok_or_else(lacks)?;
    }
    Ok(Skeleton { rest })
}

/// Reads a pose file.
///
/// # Errors
/// [`PipelineError`] where it is missing or not what it should be.
pub fn read_pose(path: &Path) -> Result<Pose, PipelineError> {
    let pose: Pose = json::read(path)?;
    if pose.rotations.len() == JOINT_COUNT {
        return Ok(pose);
    }
    let reason = format!("{} rotations instead of {JOINT_COUNT}; delete it and run again", pose.rotations.len());
    Err(PipelineError::field(path, "rotations", reason))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_is_read_back() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("pose.json");
        std::fs::write(&path, json::pretty(&Pose::identity()).unwrap()).unwrap();
        assert_eq!(read_pose(&path).unwrap(), Pose::identity());
        std::fs::write(&path, "{\"translation\": [0, 0, 0], \"rotations\": []}").unwrap();
        assert!(read_pose(&path).unwrap_err().to_string().contains("0 rotations"));
    }
}
