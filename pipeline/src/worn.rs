//! Garments that a subject wears without having been scanned in them: `SUBJECT/worn/NN-name/`.
//!
//! A folder holds all that is needed to put the garment on again: `garment.ply` (with its skin weights, in the pose in which it was
//! cut), `body.ply` (at rest, the body that it was cut from) and `worn.json` ([`WornFile`]). Whoever it was cut from is not needed again.

use std::{collections::BTreeMap, fs, path::PathBuf};

use serde::{Deserialize, Serialize};
use toile_capture::files::is_there;
use toile_character::{BodyModel, GarmentType, Pose, Skeleton, SkinWeights, SkinnedMesh, joint::JOINTS};
use toile_garments::cloth_thickness;
use toile_geometry::{Mesh, ply};

use crate::{
    PipelineError, body_file,
    folders::Folders,
    garment::Garment,
    hash, json,
    meshes::{encode_skinned, read_skinned},
};

/// The form of `worn.json` that this program writes and reads.
const VERSION: u32 = 1;

/// The content of `worn.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WornFile {
    /// The form of this file.
    pub version: u32,
    /// Where the garment is from, in words: `alder/03-jacket`.
    pub source: String,
    /// SHA-256 of the garment's own mesh and weights: the same garment is known again by it.
    pub garment: String,
    /// Its type.
    #[serde(rename = "type")]
    pub garment_type: GarmentType,
    /// Thickness of its cloth, millimetres; without, what is common for its type.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thickness_mm: Option<f32>,
    /// Where it is worn.
    #[serde(default)]
    pub place: Place,
    /// Joints at rest of the body that it was cut from, by VRM name, metres.
    pub rest_joints: BTreeMap<String, [f64; 3]>,
    /// The pose in which it is given.
    pub pose: Pose,
}

/// Where among the layers something is worn.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Place {
    /// Over all layers.
    #[default]
    Outermost,
    /// Right over the layer of this folder name.
    Over(String),
    /// Right under it.
    Under(String),
}

/// A garment with the body that it was cut from.
pub struct Cloth {
    /// Its mesh, in `pose`.
    pub mesh: Mesh,
    /// Its skin weights.
    pub weights: SkinWeights,
    /// The body.
    pub body: SkinnedMesh,
    /// The pose in which the body wears it.
    pub pose: Pose,
}

impl Cloth {
    /// SHA-256 of mesh and weights.
    pub fn hash(&self) -> String {
        hash::bytes(&encode_skinned(&self.mesh, &self.weights))
    }
}

/// A garment in `SUBJECT/worn/`.
#[derive(Debug, Clone)]
pub struct WornGarment {
    /// Name of its folder, and of its layer: `03-jacket`.
    pub label: String,
    /// What is noted about it.
    pub file: WornFile,
}

/// What the subject at `folders` wears beside the layers of its takes, in the order of their folders' names.
///
/// # Errors
/// [`PipelineError`] where a folder cannot be listed, or a `worn.json` is not what it should be.
pub fn listed(folders: &Folders) -> Result<Vec<WornGarment>, PipelineError> {
    let all = folders.all_worn();
    let entries = match fs::read_dir(&all) {
        Ok(entries) => entries,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(PipelineError::io(&all, error)),
    };
    let mut labels = Vec::new();
    for entry in entries {
        let entry = entry.map_err(|e| PipelineError::io(&all, e))?;
        let label = entry.file_name().to_string_lossy().into_owned();
        // A folder without its record was not finished.
        if is_there(&folders.worn_json(&label)) {
            labels.push(label);
        }
    }
    labels.sort();
    let read = |label: String| {
        let path = folders.worn_json(&label);
        let file: WornFile = json::read(&path)?;
        if file.version != VERSION {
            let reason = format!("{} is a form that this program does not know; use a newer one", file.version);
            return Err(PipelineError::field(&path, "version", reason));
        }
        Ok(WornGarment { label, file })
    };
    labels.into_iter().map(read).collect()
}

impl WornGarment {
    /// The files that it is put on from.
    pub fn files(&self, folders: &Folders) -> [PathBuf; 3] {
        let folder = folders.worn(&self.label);
        [folder.join("garment.ply"), folder.join("body.ply"), folders.worn_json(&self.label)]
    }

    /// Reads the garment.
    ///
    /// # Errors
    /// [`PipelineError`] where a file is missing or not what it should be.
    pub fn cloth(&self, folders: &Folders, model: &BodyModel) -> Result<Cloth, PipelineError> {
        let [garment, body, about] = self.files(folders);
        let (mesh, weights) = read_skinned(&garment)?;
        let body = ply::read(&body)?;
        let skeleton = body_file::skeleton(&about, &self.file.rest_joints)?;
        let body = SkinnedMesh::new(body, skeleton, model.weights.clone())?;
        Ok(Cloth { mesh, weights, body, pose: self.file.pose.clone() })
    }

    /// Its facts as a layer of the avatar.
    pub fn layer(&self) -> Garment {
        Garment {
            number: None,
            garment_type: self.file.garment_type,
            thickness: self.file.thickness_mm.map_or_else(|| cloth_thickness(self.file.garment_type), |mm| mm * 1e-3),
            layer: self.label.clone(),
            name: self.label.clone(),
            is_generic: false,
        }
    }
}

/// The files of a garment that is put away as `label`, the record last.
///
/// # Errors
/// [`PipelineError::Json`] where the record cannot be written as JSON.
pub fn contents(
    folders: &Folders,
    label: &str,
    cloth: &Cloth,
    about: &WornFile,
) -> Result<Vec<(PathBuf, Vec<u8>)>, PipelineError> {
    let garment = WornGarment { label: label.into(), file: about.clone() };
    let contents = [encode_skinned(&cloth.mesh, &cloth.weights), ply::encode(&cloth.body.mesh), json::pretty(about)?];
    Ok(garment.files(folders).into_iter().zip(contents).collect())
}

impl WornFile {
    /// Of a garment from `source`.
    pub fn new(source: &str, cloth: &Cloth, garment_type: GarmentType, place: Place) -> Self {
        let rest = |skeleton: &Skeleton| {
            let joint = |j: &toile_character::Joint| (j.name().to_string(), skeleton.position(*j).into());
            JOINTS.iter().map(joint).collect::<BTreeMap<String, [f64; 3]>>()
        };
        Self {
            version: VERSION,
            source: source.into(),
            garment: cloth.hash(),
            garment_type,
            thickness_mm: None,
            place,
            rest_joints: rest(&cloth.body.skeleton),
            pose: cloth.pose.clone(),
        }
    }
}
