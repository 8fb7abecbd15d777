//! All stages in their order: from recorded takes to a dressed avatar and its report.

use std::path::Path;

use toile_character::BodyModel;

use crate::{
    Observer, PipelineError, Run, body_file, garment,
    options::{Goal, Options},
    steps::{cut, export, fit, fuse, pose, report, stack},
    summary::Summary,
};

/// Takes the subject at `root` to `goal`, doing whatever is missing.
///
/// # Errors
/// [`PipelineError`] where a stage has no answer or a file cannot be read or written; what was done stays.
pub fn process(root: &Path, goal: Goal, options: &Options, observer: &dyn Observer) -> Result<Summary, PipelineError> {
    let mut run = Run::open(root, options.last_layer.as_deref(), observer)?;
    // What would fail only after a long time.
    (1..run.layers.len()).try_for_each(|n| garment::told_thickness(&run, n).map(drop))?;
    observer.plan(cost(&run, goal));
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
    summary.finish(&run, goal, report::measurements(&run).unwrap_or_default());
    Ok(summary)
}

/// From the body to the report.
fn dress(
    run: &mut Run,
    model: &BodyModel,
    goal: Goal,
    options: &Options,
    summary: &mut Summary,
) -> Result<(), PipelineError> {
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
        summary.add("avatar", "export", export::run(run, &body, options)?);
    }
    if goal >= Goal::Report {
        report::run(run, &body, options.motion.as_deref(), summary)?;
    }
    Ok(())
}

/// Expected seconds to `goal`.
fn cost(run: &Run, goal: Goal) -> f64 {
    let (takes, garments) = (run.layers.len() as f64, run.layers.len().saturating_sub(1) as f64);
    let costs = [
        (Goal::Scans, takes * fuse::COST),
        (Goal::Body, fit::COST),
        (Goal::Garments, garments * (pose::COST + cut::COST + stack::COST)),
        (Goal::Avatar, export::COST),
        (Goal::Report, report::COST),
    ];
    costs.iter().filter(|c| c.0 <= goal).map(|c| c.1).sum()
}
