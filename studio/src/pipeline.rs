//! The stages in their order: from recorded takes to a dressed avatar and its report.
//!
//! Each stage is a file: what it reads, what it writes, and the one call into the stage's crate. A stage reads files and
//! writes files, so that a run can stop anywhere and go on later with the same result.

pub mod body_file;
pub mod cut;
pub mod deliverables;
pub mod fit;
pub mod folders;
pub mod fuse;
pub mod garment;
pub mod motion;
pub mod opened;
pub mod page;
pub mod pose;
pub mod run;
pub mod skin_attributes;
pub mod stack;

use std::path::{Path, PathBuf};

use serde::Serialize;
use toile_character::{BodyModel, JointNaming};
use toile_fusion::FusionSettings;
use toile_garments::CullSettings;

use crate::{Progress, StudioError, stage::Record};

pub use run::Run;

/// How far to go.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Goal {
    /// A scan of each take.
    Scans,
    /// The body of the first scan.
    Body,
    /// The garments in the common frame.
    Garments,
    /// The avatar's files.
    Avatar,
    /// The page for the operator.
    Report,
}

/// What may be chosen for a whole run.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// BVH motion for the avatar; without, the shipped walk.
    pub motion: Option<PathBuf>,
    /// How takes are fused.
    pub fusion: FusionSettings,
    /// What the joints are called in `avatar.glb`.
    pub joint_names: JointNaming,
    /// Stop after this layer; without, all of them.
    pub last_layer: Option<String>,
    /// Leave out of the avatar what clothes hide; without, it is whole.
    pub cull: Option<CullSettings>,
}

impl Options {
    /// Checks what would fail only after a long time.
    ///
    /// # Errors
    /// [`StudioError`] where the motion cannot be used.
    pub fn check(&self) -> Result<(), StudioError> {
        self.motion.as_deref().map_or(Ok(()), motion::check)
    }
}

/// What a run made and what is to be said of it.
#[derive(Debug, Default, Serialize)]
pub struct Summary {
    /// The layers, body first.
    pub layers: Vec<String>,
    /// Measurements by name: metres, cubic metres.
    pub measurements: serde_json::Value,
    /// The files that were asked for.
    pub files: Vec<String>,
    /// What each stage decided, by layer and stage.
    pub stages: Vec<(String, Record)>,
    /// What to worry about.
    pub warnings: Vec<String>,
    /// Recorded data that was lost.
    pub lost: Vec<String>,
    /// What failed although the run went on.
    pub failures: Vec<String>,
}

/// Takes the subject at `root` to `goal`, doing whatever is missing.
///
/// # Errors
/// [`StudioError`] where a stage has no answer or a file cannot be read or written; what was done stays.
pub fn process(root: &Path, goal: Goal, options: &Options, progress: &Progress) -> Result<Summary, StudioError> {
    let mut run = Run::open(root, options.last_layer.as_deref(), progress)?;
    // What would fail only after a long time.
    (1..run.layers.len()).try_for_each(|n| garment::told_thickness(&run, n).map(drop))?;
    run.plan(goal);
    let mut summary = Summary::default();
    for layer in &run.layers {
        summary.add(layer, "fuse", fuse::run(&run, layer, &options.fusion)?);
    }
    if goal >= Goal::Body {
        let model = BodyModel::load_default()?;
        summary.add("body", "fit", fit::run(&run, &model)?);
        if goal >= Goal::Garments {
            dress(&mut run, &model, goal, options, &mut summary)?;
        }
    }
    summary.finish(&run, goal);
    Ok(summary)
}

/// From the body to the report.
fn dress(
    run: &mut Run,
    model: &BodyModel,
    goal: Goal,
    options: &Options,
    summary: &mut Summary,
) -> Result<(), StudioError> {
    let body = body_file::Body::load(&run.folders, run.first_layer(), model)?;
    for n in 1..run.layers.len() {
        let layer = run.layers[n].clone();
        let pose = pose::run(run, n, &body, model)?;
        let cut = cut::run(run, n, pose::worn_as(run, n, &pose), &body)?;
        if !cut.failures.is_empty() {
            run.leave_out(&layer)?;
        }
        summary.add(&layer, "pose", pose);
        summary.add(&layer, "cut", cut);
    }
    summary.add("layers", "stack", stack::run(run, &body)?);
    if goal >= Goal::Avatar {
        summary.add("avatar", "export", deliverables::run(run, &body, options)?);
    }
    if goal >= Goal::Report {
        page::run(run, &body, options.motion.as_deref(), summary)?;
    }
    Ok(())
}

impl Summary {
    fn add(&mut self, layer: &str, stage: &str, record: Record) {
        self.warnings.extend(record.warnings.iter().cloned());
        self.lost.extend(record.lost.iter().cloned());
        self.failures.extend(record.failures.iter().cloned());
        self.stages.push((format!("{layer}/{stage}"), record));
    }

    fn finish(&mut self, run: &Run, goal: Goal) {
        self.layers = std::iter::once("body".to_string()).chain(run.garments().map(String::from)).collect();
        let folders = &run.folders;
        let files = match goal {
            Goal::Scans => run.layers.iter().map(|l| folders.scan(l)).collect(),
            Goal::Body => vec![folders.body_mesh(), folders.body_json()],
            Goal::Garments => run.garments().map(|l| folders.garment(l)).collect(),
            Goal::Avatar => vec![folders.glb(), folders.vrm()],
            Goal::Report => vec![folders.glb(), folders.vrm(), folders.report()],
        };
        self.files = files.iter().map(|p| p.display().to_string()).collect();
        self.measurements = page::measurements(run).unwrap_or_default();
    }
}
