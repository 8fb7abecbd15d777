//! Stage `pose`: the body inside the scan of a dressed take.
//!
//! Reads the scan, the scans of the takes before with their poses, and the body. Writes `pose.json` and `body.ply`. Where much of
//! what the take before wore is missing in the scan, an earlier take is looked for that it wears again: something was taken off.

use serde_json::json;
use toile_character::BodyModel;
use toile_fitting::{UnderFit, UnderSettings, Verdict, pose_under, rigged_scan, settle_under};
use toile_geometry::ply;

use crate::{
    PipelineError, Run,
    body_file::{Body, pose_bytes, read_pose},
    stage::{Product, Record, Stage, plain},
};

/// Raised whenever the same inputs and settings give another pose.
const VERSION: u32 = 8;
/// With more than this share of the take before outside the scan, earlier takes are tried; one with half of that is believed.
const OUTSIDE: f64 = 0.1;
/// Key of the result that names the take whose scan was found again.
const WORN_AS: &str = "worn_as_in";
/// Expected seconds.
pub const COST: f64 = 2.0;

/// Poses the body inside take `n` (1 or more), unless that is up to date.
///
/// # Errors
/// [`PipelineError`] where the dressed person cannot be found in the scan, or files cannot be read or written.
pub fn run(run: &Run, n: usize, body: &Body, model: &BodyModel) -> Result<Record, PipelineError> {
    let folders = &run.folders;
    let layer = run.layers[n].as_str();
    let before = &run.layers[..n];
    let settings = UnderSettings::default();
    let (scan_path, pose_path, body_path) = (folders.scan(layer), folders.pose(layer), folders.posed_body(layer));
    let stage = Stage {
        name: "pose",
        version: VERSION,
        cost: COST,
        root: &folders.root,
        folder: folders.layer(layer),
        inputs: [scan_path.clone(), folders.body_rest(), folders.body_json()]
            .into_iter()
            .chain(before.iter().flat_map(|l| [folders.scan(l), folders.pose(l)]))
            .collect(),
        settings: plain(&settings)?,
        outputs: vec![pose_path.clone(), body_path.clone()],
        outputs_vary: false,
    };
    stage.run(&run.label(layer, "pose"), run.observer, |progress| {
        let scan = run.read_mesh(&scan_path)?;
        let habit = read_pose(&folders.pose(run.first_layer()))?;
        let fit_as = |worn: &str| {
            let scan_before = run.read_mesh(&folders.scan(worn))?;
            let dressed = rigged_scan(&scan_before, &body.skinned, &read_pose(&folders.pose(worn))?);
            // limbs are drawn to how they were seen undressed: what clothes hide goes astray a little in each take
            pose_under(&dressed, &[], &habit, &scan, &settings, progress)
                .map_err(|e| PipelineError::stage(&scan_path, e))
        };
        let (mut worn_as, mut fit) = (n - 1, fit_as(&before[n - 1])?);
        for earlier in (0..n - 1).rev() {
            if fit.report.outside <= OUTSIDE {
                break;
            }
            let Ok(other) = fit_as(&before[earlier]) else { continue };
            // Loose cloth that swung is outside too, but then less, not more of an earlier take is seen again.
            let is_better =
                other.report.verdict <= fit.report.verdict && other.report.uncovered >= fit.report.uncovered;
            if is_better && other.report.outside < 0.5 * fit.report.outside {
                (worn_as, fit) = (earlier, other);
            }
        }
        if fit.report.verdict == Verdict::Failed {
            let reason =
                format!("the person of the take before was not found in it: {}", fit.report.reasons.join("; "));
            return Err(PipelineError::stage(&scan_path, reason));
        }
        let settled = settle_under(model, &body.skinned, &fit.pose, &scan, &settings)
            .map_err(|e| PipelineError::stage(&scan_path, e))?;
        Ok(Product {
            files: vec![
                (pose_path.clone(), pose_bytes(&settled.pose)?),
                (body_path.clone(), ply::encode(&settled.mesh)),
            ],
            warnings: warnings(layer, &fit, &before[worn_as..]),
            result: json!({ "pose": plain(&fit.report)?, "settle": plain(&settled.report)?, WORN_AS: before[worn_as] }),
            ..Product::default()
        })
    })
}

/// What to say of take `layer`, which is worn as the first of `since` was.
fn warnings(layer: &str, fit: &UnderFit, since: &[String]) -> Vec<String> {
    let mut warnings: Vec<String> = fit.report.reasons.iter().map(|r| format!("{layer}: pose: {r}")).collect();
    if let [same, missing @ ..] = since
        && !missing.is_empty()
    {
        let missing = missing.join(", ");
        warnings.push(format!("{layer}: it is worn as in {same}: was {missing} taken off? it is compared with {same}"));
    }
    warnings
}

/// The take, by its number, that take `n` is worn as, with one layer more; by the record of its pose.
pub fn worn_as(run: &Run, n: usize, record: &Record) -> usize {
    let found = record.result[WORN_AS].as_str().and_then(|name| run.layers.iter().position(|l| l == name));
    found.unwrap_or(n - 1)
}
