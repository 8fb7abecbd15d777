//! Stage `fit`: the undressed scan → the body: shape, pose, own surface, weights, measures.
//!
//! Reads `00-body/scan.ply` and, where there is one, `SUBJECT/edits/body.json`. Writes `00-body/pose.json` and in `body/`: `body.ply`, `model.ply`, `rest.ply`,
//! `rigged_scan.glb`, `body.json`, `measurements.json`, `measurements.csv`, `standing.ply`.

use std::path::{Path, PathBuf};

use nalgebra::{Point3, Translation3};
use serde::Deserialize;
use toile_character::{BodyModel, JointRegressor};
use toile_fitting::{BodyFit, FitReport, FitSettings, HandLandmarks, Mend, Verdict, fit_body, measure_table, rig_scan};
use toile_geometry::{Mesh, Rigid, color_transfer::closest_colors, ply};

use crate::{
    PipelineError, Run,
    body_file::pose_bytes,
    rigged_scan::rigged_scan,
    stage::{self, Product, Record, Stage, plain},
};

/// Raised whenever the same scan and settings give another body.
const VERSION: u32 = 6;
/// Expected seconds.
pub const COST: f64 = 4.0;

/// What a fit writes into the body's folder.
pub const FILES: [&str; 8] = [
    "body.ply",
    "model.ply",
    "rest.ply",
    "rigged_scan.glb",
    "body.json",
    "measurements.json",
    "measurements.csv",
    "standing.ply",
];

/// Where the files of a fit go.
pub struct Place {
    /// The scan.
    pub scan: PathBuf,
    /// Folder of the body's files.
    pub folder: PathBuf,
    /// Pose of the body in the scan.
    pub pose: PathBuf,
    /// The files stay in the scan's own frame, as later stages need it; else they stand upright, in metres.
    pub keep_frame: bool,
    /// What somebody said about the body.
    pub edits: BodyEdits,
}

/// What is said by hand about the body: the content of `SUBJECT/edits/body.json`.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodyEdits {
    /// 1.
    #[serde(rename = "version")]
    _version: BodyEditsVersion,
    /// There is no undressed take: the first one shows the person dressed, and the body is estimated.
    #[serde(default)]
    pub dressed: bool,
    /// Landmarks by the template's names: metres, in the frame of the first take's scan.
    #[serde(default)]
    pub landmarks: HandLandmarks,
    /// Shape components used; without, the default of [`FitSettings`].
    #[serde(default)]
    pub components: Option<usize>,
    /// How joints follow the shape.
    #[serde(default)]
    pub joints: JointRegressor,
}

#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(try_from = "u32")]
struct BodyEditsVersion;

impl TryFrom<u32> for BodyEditsVersion {
    type Error = String;

    fn try_from(version: u32) -> Result<Self, String> {
        if version == 1 { Ok(Self) } else { Err(format!("version {version}, but this program knows 1")) }
    }
}

impl BodyEdits {
    fn settings(&self) -> FitSettings {
        let defaults = FitSettings::default();
        FitSettings {
            dressed: self.dressed,
            landmarks: self.landmarks.clone(),
            components: self.components.unwrap_or(defaults.components),
            joints: self.joints,
            ..defaults
        }
    }

    /// Reads a file of edits.
    ///
    /// # Errors
    /// [`PipelineError::Format`] where it is none, and why.
    pub fn read(path: &Path) -> Result<Self, PipelineError> {
        let bytes = std::fs::read(path).map_err(|e| PipelineError::io(path, e))?;
        serde_json::from_slice(&bytes).map_err(|e| PipelineError::format(path, format!("no edits of a body: {e}")))
    }
}

/// Fits the body of a subject, unless that is up to date.
///
/// # Errors
/// [`PipelineError`] where the scan cannot be a person, or files cannot be read or written.
pub fn run(run: &Run, model: &BodyModel) -> Result<Record, PipelineError> {
    let layer = run.first_layer();
    let folders = &run.folders;
    let edits = Some(folders.edits("body")).filter(|p| p.exists());
    let place = Place {
        scan: folders.scan(layer),
        folder: folders.body(),
        pose: folders.pose(layer),
        keep_frame: true,
        edits: edits.as_deref().map(BodyEdits::read).transpose()?.unwrap_or_default(),
    };
    fit(run, &place, model)
}

/// Fits a body to any scan.
///
/// # Errors
/// As [`run`].
pub fn fit(run: &Run, place: &Place, model: &BodyModel) -> Result<Record, PipelineError> {
    let settings = place.edits.settings();
    let at = |name: &str| place.folder.join(name);
    let stage = Stage {
        name: "fit",
        version: VERSION,
        cost: COST,
        root: &run.folders.root,
        folder: place.folder.clone(),
        inputs: vec![place.scan.clone()],
        settings: plain(&settings)?,
        outputs: FILES.iter().map(|n| at(n)).chain([place.pose.clone()]).collect(),
        outputs_vary: false,
    };
    stage.run(&run.label("body", "fit"), run.observer, |progress| {
        let scan = run.read_mesh(&place.scan)?;
        let mut fit = fit_body(model, &scan, &settings, progress).map_err(|e| PipelineError::stage(&place.scan, e))?;
        if place.keep_frame {
            back_to_the_scan(&mut fit, place)?;
        }
        product(place, model, &scan, &fit)
    })
}

/// Undoes the turn with which a scan that did not stand upright was fitted.
fn back_to_the_scan(fit: &mut BodyFit, place: &Place) -> Result<(), PipelineError> {
    if (fit.mend.scale - 1.0).abs() > 1e-9 {
        let reason = "the person in it is not of human size: is depth_scale of the recording right?";
        return Err(PipelineError::stage(&place.scan, reason));
    }
    let scan_from_upright = Rigid::from_parts(Translation3::identity(), fit.mend.rotation.inverse());
    fit.pose = fit.pose.moved(&scan_from_upright, &fit.skeleton);
    fit.model_mesh = fit.model_mesh.transformed(&scan_from_upright);
    for landmark in &mut fit.landmarks {
        landmark.position = (scan_from_upright * Point3::from(landmark.position)).into();
    }
    fit.mend = Mend::default();
    Ok(())
}

fn product(place: &Place, model: &BodyModel, scan: &Mesh, fit: &BodyFit) -> Result<Product, PipelineError> {
    let at = |name: &str| place.folder.join(name);
    let report = &fit.report;
    if fit.verdict() == Verdict::Failed {
        let reason = format!("no person could be fitted: {}", report.reasons.join("; "));
        return Err(PipelineError::stage(&place.scan, reason));
    }
    let scan = fit.mend.apply(scan);
    let weights = rig_scan(&scan, &fit.body, &fit.pose);
    let rigged = rigged_scan(&scan, &weights, &fit.skeleton, &fit.pose)?;
    let mut body = fit.posed_body();
    body.colors = closest_colors(&scan, &body.positions, &body.normals);
    let table = measure_table(model, &fit.body).map_err(|e| PipelineError::stage(&place.scan, e))?;
    let files = vec![
        (at("measurements.json"), stage::pretty(&table)?),
        (at("measurements.csv"), table.csv().into_bytes()),
        (at("standing.ply"), ply::encode(&table.standing)),
        (at("body.ply"), ply::encode(&body)),
        (at("model.ply"), ply::encode(&fit.model_mesh)),
        (at("rest.ply"), ply::encode(&fit.body.mesh)),
        (at("rigged_scan.glb"), rigged),
        (at("body.json"), stage::pretty(&fit.summary())?),
        (place.pose.clone(), pose_bytes(&fit.pose)?),
    ];
    Ok(Product { files, result: plain(report)?, warnings: warnings(report), ..Product::default() })
}

fn warnings(report: &FitReport) -> Vec<String> {
    let doubts = report.reasons.iter().map(|r| format!("body: {r}"));
    doubts.chain(report.notices.iter().map(|n| format!("body: {n}"))).collect()
}
