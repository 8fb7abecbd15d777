//! A fitted body as implicit primitives: `SUBJECT/build/implicit/`.

use std::{
    fs,
    path::{Path, PathBuf},
};

use serde_json::Value;
use toile_avatar::{Avatar, AvatarLayer, write_glb};
use toile_capture::files::atomic_write_all;
use toile_character::{BodyModel, JointNaming, transfer::closest_triangle_weights};
use toile_geometry::ply;
use toile_implicit::{
    Envelope, LEVELS,
    fit::{FitSettings, FitStep, fit},
    format,
};

use crate::{
    Goal, Observer, Options, PipelineError, Run, body_file::Body, json, motion, process::process, settings,
    step::Remarks,
};

/// Expected seconds of a fit.
const SECONDS: f64 = 3.0;

/// What was written.
#[derive(Debug)]
pub struct Sculpted {
    /// `body.toml` (the primitives), `body.ply` (their surface in scan 0's pose) and `avatar-implicit.glb` (the same with skeleton, weights and
    /// the walk).
    pub files: [PathBuf; 3],
    /// The last step of the fit.
    pub fitted: FitStep,
    /// Bytes of `body.toml`.
    pub bytes: usize,
    /// What the operator should know, also of what was built first.
    pub remarks: Remarks,
}

/// Fits primitives to the body of the subject at `root` and writes them; a body that is missing or stale is fitted first.
///
/// # Errors
/// [`PipelineError`] where a stage has no answer or a file cannot be read or written.
pub fn sculpt(root: &Path, settings_file: Option<&Path>, observer: &dyn Observer) -> Result<Sculpted, PipelineError> {
    let settings_file = settings_file.map(Path::to_path_buf);
    let building = Options { settings: settings_file.clone(), ..Options::default() };
    let summary = process(root, Goal::Body, &building, observer)?;
    let mut remarks = summary.remarks;
    remarks.warnings.extend(summary.notes);
    let run = Run::open(root, None, settings::read(Some(root), settings_file.as_deref())?, observer)?;
    let (folders, model) = (&run.folders, BodyModel::load_default()?);
    let body = Body::load(folders, run.first_layer(), &model)?;
    let beta = beta(&folders.body_json())?;
    observer.begin(&run.label("body", "sculpt"), SECONDS);
    let folder = folders.build().join("implicit");
    let wrong = |e: toile_implicit::ImplicitError| PipelineError::stage(&folder, e);
    let poses = [body.pose0.clone(), model.t_pose(&beta)];
    let fitted = fit(&model, &body.skinned, &beta, run.title(), &poses, &FitSettings::default()).map_err(wrong)?;
    let last = *fitted.steps.last().ok_or_else(|| PipelineError::refused(&folder, "no primitive was fitted"))?;
    let envelope = Envelope::new(&model, &fitted.body, LEVELS[0]).map_err(wrong)?;
    let mut mesh = envelope.sample(&fitted.body, &body.pose0).mesh;
    mesh.recompute_normals();
    let posed = body.skinned.posed_mesh(&body.pose0);
    let weights = closest_triangle_weights(&posed, &body.skinned.weights, &mesh.positions);
    let walk = motion::load(None, &body.skinned, &run.settings.motion)?.motion;
    let layer =
        AvatarLayer { name: "body".into(), mesh, weights, order: 0, garment: None, thickness: None, texture: None };
    let avatar = Avatar {
        name: run.title().to_string(),
        skeleton: body.skinned.skeleton.clone(),
        joint_names: JointNaming::Vrm,
        pose0: body.pose0.clone(),
        layers: vec![layer],
        motions: vec![walk],
    };
    let glb = write_glb(&avatar).map_err(|e| PipelineError::stage(&folder, e))?;
    let text = format::write(&fitted.body);
    let surface = ply::encode(&avatar.layers[0].mesh);
    fs::create_dir_all(&folder).map_err(|e| PipelineError::io(&folder, e))?;
    let files = ["body.toml", "body.ply", "avatar-implicit.glb"].map(|name| folder.join(name));
    let bytes = text.len();
    let contents = [text.into_bytes(), surface, glb];
    atomic_write_all(&files.iter().cloned().zip(contents).collect::<Vec<_>>())?;
    observer.end();
    Ok(Sculpted { files, fitted: last, bytes, remarks })
}

/// The shape coefficients in `body.json`.
fn beta(path: &Path) -> Result<Vec<f64>, PipelineError> {
    let all: Value = json::read(path)?;
    serde_json::from_value(all["beta"].clone()).map_err(|e| PipelineError::field(path, "beta", e))
}
