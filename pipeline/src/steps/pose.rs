//! Step `pose`: the body inside the scan of a dressed take.
//!
//! Reads the scan, the scans of the takes before with their poses, and the body. Writes `pose.json` and `body.ply`. Where
//! much of what the take before wore is missing in the scan, an earlier take is looked for that it wears again: something
//! was taken off.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use serde_json::Value;
use toile_character::BodyModel;
use toile_fitting::{SettleReport, UnderReport, Verdict, pose_as_worn, pose_under, rigged_scan, settle_under};
use toile_geometry::ply;

use crate::{
    PipelineError, Run,
    body_file::{Body, read_pose},
    json,
    meshes::read_mesh,
    step::{Product, Step},
};

/// Posing the body inside a dressed take.
pub struct PoseUnder<'a> {
    /// The run.
    pub run: &'a Run<'a>,
    /// Number of the take, 1 or more.
    pub number: usize,
    /// The body.
    pub body: &'a Body,
    /// The statistical model.
    pub model: &'a BodyModel,
}

/// The decisions of posing.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct PoseReport {
    /// How well the person of an earlier take was found in this one.
    pub pose: UnderReport,
    /// The moves of settling the body.
    pub settle: SettleReport,
    /// The earlier take that this one is worn as, with one layer more.
    pub worn_as_in: String,
}

impl PoseUnder<'_> {
    fn layer(&self) -> &str {
        &self.run.layers[self.number]
    }

    fn before(&self) -> &[String] {
        &self.run.layers[..self.number]
    }
}

impl Step for PoseUnder<'_> {
    type Report = PoseReport;
    const NAME: &'static str = "pose";
    const VERSION: u32 = 9;
    const SECONDS: f64 = 2.0;

    fn label(&self) -> String {
        self.run.label(self.layer(), "pose")
    }

    fn folder(&self) -> PathBuf {
        self.run.folders.layer(self.layer())
    }

    fn inputs(&self) -> Result<Vec<PathBuf>, PipelineError> {
        let folders = &self.run.folders;
        let of_body = [folders.scan(self.layer()), folders.body_rest(), folders.body_json()];
        let of_before = self.before().iter().flat_map(|l| [folders.scan(l), folders.pose(l)]);
        Ok(of_body.into_iter().chain(of_before).collect())
    }

    fn settings(&self) -> Result<Value, PipelineError> {
        json::plain(&self.run.settings.under_clothes)
    }

    fn outputs(&self) -> Vec<PathBuf> {
        vec![self.run.folders.pose(self.layer()), self.run.folders.posed_body(self.layer())]
    }

    fn work(&self, progress: &(dyn Fn(f32) + Sync)) -> Result<Product<PoseReport>, PipelineError> {
        let (folders, body, before) = (&self.run.folders, self.body, self.before());
        let path = folders.scan(self.layer());
        let scan = read_mesh(&path)?;
        let habit = read_pose(&folders.pose(self.run.first_layer()))?;
        let fit_as = |earlier: usize| {
            let worn = &before[earlier];
            let dressed =
                rigged_scan(&read_mesh(&folders.scan(worn))?, &body.skinned, &read_pose(&folders.pose(worn))?);
            // Limbs are drawn to how they were seen undressed: what clothes hide goes astray a little in each take.
            pose_under(&dressed, &[], &habit, &scan, &self.run.settings.under_clothes, progress)
                .map_err(|e| PipelineError::stage(&path, e))
        };
        let (worn_as, fit) = pose_as_worn(before.len(), fit_as)?;
        if fit.report.verdict == Verdict::Failed {
            let reasons = fit.report.reasons.join("; ");
            return Err(PipelineError::refused(
                &path,
                format!("the person of the take before was not found in it: {reasons}"),
            ));
        }
        let settled = settle_under(self.model, &body.skinned, &fit.pose, &scan, &self.run.settings.under_clothes);
        let settled = settled.map_err(|e| PipelineError::stage(&path, e))?;
        let contents = [json::pretty(&settled.pose)?, ply::encode(&settled.mesh)];
        let files = self.outputs().into_iter().zip(contents).collect();
        let warnings = warnings(self.layer(), &fit.report, &before[worn_as..]);
        let worn_as_in = before[worn_as].clone();
        Ok(Product::new(files, PoseReport { pose: fit.report, settle: settled.report, worn_as_in }, warnings))
    }
}

/// Remarks about take `layer`, which is worn as the first of `since` was.
fn warnings(layer: &str, fit: &UnderReport, since: &[String]) -> Vec<String> {
    let mut warnings: Vec<String> = fit.reasons.iter().map(|r| format!("{layer}: pose: {r}")).collect();
    if let [same, missing @ ..] = since
        && !missing.is_empty()
    {
        let missing = missing.join(", ");
        warnings.push(format!("{layer}: it is worn as in {same}: was {missing} taken off? it is compared with {same}"));
    }
    warnings
}
