//! Step `cut`: the new garment out of a dressed take's scan.
//!
//! Reads the scan, the scan of the take that it is compared with (a first take that is dressed is compared with the body alone), both poses, the body, and the layer's edits where there
//! are any. Writes `cut.ply`, the garment in the take's own pose and frame, and `unstacked.ply`, the same in the common
//! frame with its skin weights as vertex attributes. Both are empty where nothing new is worn: the record then has a
//! failure, and the layer is left out.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use toile_capture::files::{is_there, read_limited};
use toile_character::Pose;
use toile_fitting::rigged_scan;
use toile_garments::{DressedTake, Edits, Extraction, ExtractionReport, extract};
use toile_geometry::{Mesh, ply};

use crate::{
    PipelineError, Run,
    body_file::{Body, read_pose},
    json,
    meshes::{encode_skinned, read_mesh},
    step::{Product, Remarks, Step},
};

/// More unsure vertices than this are worth a warning.
const UNSURE_SHARE: f32 = 0.15;

/// Cutting out what a take wears and an earlier one does not.
pub struct Cut<'a> {
    /// The run.
    pub run: &'a Run<'a>,
    /// Number of the take; 0 where the first one is dressed.
    pub number: usize,
    /// Folder name of the take that it is worn as, with one layer more; take 0 is worn as itself.
    pub worn_as: &'a str,
    /// The body.
    pub body: &'a Body,
}

impl Cut<'_> {
    fn layer(&self) -> &str {
        &self.run.layers[self.number]
    }

    /// The layer's edits, where there are any.
    fn edits(&self) -> Option<PathBuf> {
        Some(self.run.folders.edits(self.layer())).filter(|path| is_there(path))
    }

    /// The surface worn before in this take's `pose`: the take's that it is compared with, or for take 0 the body.
    fn worn_before(&self, pose: &Pose, posed_body: &Mesh) -> Result<Mesh, PipelineError> {
        if self.number == 0 {
            return Ok(posed_body.clone());
        }
        let (folders, before) = (&self.run.folders, self.worn_as);
        let (scan, pose_before) = (read_mesh(&folders.scan(before))?, read_pose(&folders.pose(before))?);
        Ok(rigged_scan(&scan, &self.body.skinned, &pose_before).posed_mesh(pose))
    }

    /// Remarks about the findings.
    fn remarks(&self, found: &Extraction) -> Remarks {
        let layer = self.layer();
        let (nothing, other): (Vec<_>, Vec<_>) = found.warnings.iter().partition(|w| w.is_empty());
        let mut warnings: Vec<String> = other.into_iter().map(|w| format!("{layer}: {w}")).collect();
        if found.report.unsure_share > UNSURE_SHARE {
            let percent = 100.0 * found.report.unsure_share;
            warnings.push(format!(
                "{layer}: {percent:.0} % of the garment could as well be what was worn before; look at its hem"
            ));
        }
        let take = self.run.folders.take(layer);
        let left_out = |w| {
            let take = take.display();
            format!("{take}: {w}; the avatar goes without it; record it again and import it with --retake")
        };
        Remarks { warnings, failures: nothing.into_iter().map(left_out).collect(), ..Remarks::default() }
    }
}

impl Step for Cut<'_> {
    type Report = ExtractionReport;
    const NAME: &'static str = "cut";
    const VERSION: u32 = 8;
    const SECONDS: f64 = 3.0;

    fn label(&self) -> String {
        self.run.label(self.layer(), "cut")
    }

    fn folder(&self) -> PathBuf {
        self.run.folders.layer(self.layer())
    }

    fn inputs(&self) -> Result<Vec<PathBuf>, PipelineError> {
        let folders = &self.run.folders;
        let of_takes = [self.layer(), self.worn_as].map(|l| [folders.scan(l), folders.pose(l)]);
        let of_body = [folders.body_rest(), folders.body_json(), folders.pose(self.run.first_layer())];
        Ok(of_takes.into_iter().flatten().chain(of_body).chain(self.edits()).collect())
    }

    fn settings(&self) -> Result<Value, PipelineError> {
        let garment_type = self.run.garment_type(self.number);
        Ok(json!({ "extract": json::plain(&self.run.settings.extract)?, "type": garment_type }))
    }

    fn outputs(&self) -> Vec<PathBuf> {
        vec![self.run.folders.cut(self.layer()), self.run.folders.unstacked(self.layer())]
    }

    fn work(&self, progress: &(dyn Fn(f32) + Sync)) -> Result<Product<ExtractionReport>, PipelineError> {
        let (folders, body) = (&self.run.folders, self.body);
        let path = folders.scan(self.layer());
        let (scan, pose) = (read_mesh(&path)?, read_pose(&folders.pose(self.layer()))?);
        let posed_body = body.skinned.posed_mesh(&pose);
        let previous = self.worn_before(&pose, &posed_body)?;
        let edits = self.edits().as_deref().map(read_edits).transpose()?;
        let take = DressedTake {
            scan: &scan,
            previous: &previous,
            is_first: self.number == 0,
            body: &posed_body,
            weights: &body.skinned.weights,
            skeleton: &body.skinned.skeleton,
            pose: &pose,
            pose0: &body.pose0,
            garment_type: self.run.garment_type(self.number),
            edits: edits.as_ref(),
        };
        let found = extract(&take, &self.run.settings.extract, progress).map_err(|e| PipelineError::stage(&path, e))?;
        let contents = [ply::encode(&found.in_take), encode_skinned(&found.garment, &found.weights)];
        Ok(Product {
            files: self.outputs().into_iter().zip(contents).collect(),
            remarks: self.remarks(&found),
            report: found.report,
            timings: Value::Null,
        })
    }
}

/// Reads and checks a layer's edits.
///
/// # Errors
/// [`PipelineError::Format`] where the file is not a valid edits file, and why.
pub fn read_edits(path: &Path) -> Result<Edits, PipelineError> {
    Edits::from_json(&read_limited(path, json::MAX_BYTES)?).map_err(|e| PipelineError::format(path, e))
}
