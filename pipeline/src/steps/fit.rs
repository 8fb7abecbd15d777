//! Step `fit`: the undressed scan → the body: shape, pose, own surface, weights, measures. Where the first take is dressed, the
//! body is estimated, and takes on what the clothes leave bare.
//!
//! Reads `00-body/scan.ply` and, where there is one, `SUBJECT/edits/body.json`. Writes `00-body/pose.json` and in `body/`:
//! `body.ply`, `model.ply`, `rest.ply`, `rigged_scan.glb`, `body.json`, `measurements.json`, `measurements.csv`,
//! `standing.ply`.

use std::path::{Path, PathBuf};

use nalgebra::{Point3, Translation3};
use serde_json::{Value, json};
use toile_character::BodyModel;
use toile_fitting::{
    BodyFit, FitReport, FitSettings, MeasureTable, Mend, Verdict, fit_body, measure_table, rig_scan, take_on_bare_skin,
};
use toile_garments::{DressedTake, find_cloth};
use toile_geometry::{Mesh, Rigid, color_transfer::closest_colors, ply};

use crate::{
    PipelineError, Run,
    body_edits::BodyEdits,
    json,
    meshes::{check_kind, read_mesh},
    rigged_scan::rigged_scan,
    skin_colors::body_colors,
    step::{Product, Step},
};

/// The files that a fit writes into the body's folder.
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

/// Fitting the body to a scan.
pub struct Fit<'a> {
    run: &'a Run<'a>,
    model: &'a BodyModel,
    scan: PathBuf,
    folder: PathBuf,
    /// Where the pose of the body in the scan goes.
    pose: PathBuf,
    /// The files stay in the scan's own frame, as later steps need it; else they stand upright, in metres.
    keep_frame: bool,
    settings: FitSettings,
}

impl<'a> Fit<'a> {
    /// The body of the run's subject.
    ///
    /// # Errors
    /// [`PipelineError`] where the edits of the body cannot be used.
    pub fn of_subject(run: &'a Run<'a>, model: &'a BodyModel) -> Result<Self, PipelineError> {
        let (layer, folders) = (run.first_layer(), &run.folders);
        let mut edits = BodyEdits::of_subject(folders)?;
        edits.dressed |= run.is_first_dressed();
        let (scan, folder, pose) = (folders.scan(layer), folders.body(), folders.pose(layer));
        Ok(Self { run, model, scan, folder, pose, keep_frame: true, settings: edits.over(&run.settings.fit) })
    }

    /// The body of any scan; the files go into `folder`.
    pub fn of_scan(run: &'a Run<'a>, model: &'a BodyModel, scan: &Path, folder: &Path, edits: &BodyEdits) -> Self {
        let (scan, folder, pose) = (scan.to_path_buf(), folder.to_path_buf(), folder.join("pose.json"));
        Self { run, model, scan, folder, pose, keep_frame: false, settings: edits.over(&run.settings.fit) }
    }

    /// Undoes the turn with which a scan that did not stand upright was fitted.
    fn back_to_the_scan(&self, fit: &mut BodyFit) -> Result<(), PipelineError> {
        if (fit.mend.scale - 1.0).abs() > 1e-9 {
            let reason = "the person in it is not of human size: is depth_scale of the recording right?";
            return Err(PipelineError::refused(&self.scan, reason));
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

    /// The body of `fit` on the bare skin of the dressed `scan`, and of each vertex of that whether it is cloth.
    fn undressed(&self, scan: &Mesh, fit: BodyFit) -> Result<(BodyFit, Vec<bool>), PipelineError> {
        let upright = fit.mend.apply(scan);
        let body = fit.posed_body();
        let take = DressedTake {
            scan: &upright,
            previous: &body,
            is_first: true,
            body: &body,
            weights: &fit.body.weights,
            skeleton: &fit.skeleton,
            pose: &fit.pose,
            pose0: &fit.pose,
            garment_type: None,
            edits: None,
        };
        let is_cloth =
            find_cloth(&take, &self.run.settings.extract).map_err(|e| PipelineError::stage(&self.scan, e))?;
        let fit = take_on_bare_skin(self.model, fit, scan, &is_cloth, &self.settings);
        Ok((fit.map_err(|e| PipelineError::stage(&self.scan, e))?, is_cloth))
    }

    fn files(
        &self,
        scan: &Mesh,
        is_cloth: &[bool],
        fit: &BodyFit,
        table: &MeasureTable,
    ) -> Result<Vec<(PathBuf, Vec<u8>)>, PipelineError> {
        let at = |name: &str| self.folder.join(name);
        let scan = fit.mend.apply(scan);
        let weights = rig_scan(&scan, &fit.body, &fit.pose);
        let mut body = fit.posed_body();
        body.colors = if fit.report.estimated || fit.report.part.is_some() {
            body_colors(&scan, is_cloth, &body, fit)
        } else {
            closest_colors(&scan, &body.positions, &body.normals)
        };
        Ok(vec![
            (at("measurements.json"), json::pretty(table)?),
            (at("measurements.csv"), table.csv().into_bytes()),
            (at("standing.ply"), ply::encode(&table.standing)),
            (at("body.ply"), ply::encode(&body)),
            (at("model.ply"), ply::encode(&fit.model_mesh)),
            (at("rest.ply"), ply::encode(&fit.body.mesh)),
            (at("rigged_scan.glb"), rigged_scan(&scan, &weights, &fit.skeleton, &fit.pose)?),
            (at("body.json"), json::pretty(&fit.summary())?),
            (self.pose.clone(), json::pretty(&fit.pose)?),
        ])
    }
}

impl Step for Fit<'_> {
    type Report = FitReport;
    const NAME: &'static str = "fit";
    const VERSION: u32 = 10;
    const SECONDS: f64 = 4.0;

    fn label(&self) -> String {
        self.run.label("body", "fit")
    }

    fn folder(&self) -> PathBuf {
        self.folder.clone()
    }

    fn inputs(&self) -> Result<Vec<PathBuf>, PipelineError> {
        check_kind(&self.scan)?;
        Ok(vec![self.scan.clone()])
    }

    fn settings(&self) -> Result<Value, PipelineError> {
        let fit = json::plain(&self.settings)?;
        if !self.settings.dressed {
            return Ok(fit);
        }
        Ok(json!({ "fit": fit, "extract": json::plain(&self.run.settings.extract)? }))
    }

    fn outputs(&self) -> Vec<PathBuf> {
        FILES.iter().map(|name| self.folder.join(name)).chain([self.pose.clone()]).collect()
    }

    fn work(&self, progress: &(dyn Fn(f32) + Sync)) -> Result<Product<FitReport>, PipelineError> {
        let scan = read_mesh(&self.scan)?;
        let wrong = |e| PipelineError::stage(&self.scan, e);
        let mut fit = fit_body(self.model, &scan, &self.settings, progress).map_err(wrong)?;
        if fit.verdict() == Verdict::Failed {
            let reason = format!("no person could be fitted: {}", fit.report.reasons.join("; "));
            return Err(PipelineError::refused(&self.scan, reason));
        }
        let mut is_cloth = Vec::new();
        if self.settings.dressed {
            (fit, is_cloth) = self.undressed(&scan, fit)?;
        }
        if self.keep_frame {
            self.back_to_the_scan(&mut fit)?;
        }
        let table = measure_table(self.model, &fit.body).map_err(wrong)?.of_fit(&fit);
        // What was not seen is marked in the table; what does not go together wants a look.
        let doubts = table.measures.iter().filter(|m| m.is_measured()).filter_map(|m| m.doubt.as_ref());
        let said = fit.report.reasons.iter().chain(&fit.report.notices).chain(doubts);
        let warnings = said.map(|sentence| format!("body: {sentence}")).collect();
        Ok(Product::new(self.files(&scan, &is_cloth, &fit, &table)?, fit.report, warnings))
    }
}
