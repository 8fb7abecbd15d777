//! Moving layers as files: `SUBJECT/motion/NAME/`, a point cache a layer.

mod baking;
mod caches;
mod checkpoint;
mod endless;
mod fabrics;
mod inputs;
mod mover;
mod options;
mod pictures;
mod playable;
mod report;
#[cfg(test)]
mod trials;
mod variants;

use std::path::{Component, Path, PathBuf};

use toile_animation::resample;
use toile_capture::printable;
use toile_character::{BodyModel, Motion};

use self::{fabrics::Fabrics, inputs::Baking};
pub use self::{
    options::{AnimateOptions, Profile},
    report::AnimationReport,
};
use crate::{
    Goal, Observer, Options, PipelineError, Run, avatar_choice::AvatarChoice, body_file::Body, options::MotionChoice,
    outfit, process::process, settings, step::Remarks, steps::export,
};

/// Expected seconds a frame of a garment.
const SECONDS: f64 = 0.15;

/// What was written.
#[derive(Debug)]
pub struct Animated {
    /// The folder of the motion.
    pub folder: PathBuf,
    /// The report, as it is in the folder.
    pub report: AnimationReport,
    /// What the operator should know, also of what was built first.
    pub remarks: Remarks,
}

/// Moves the layers of the subject at `root` through a motion and writes their vertices frame by frame; what the avatar lacks
/// is built first. The caches appear when all are whole.
///
/// # Errors
/// [`PipelineError`] where a stage has no answer or a file cannot be read or written; caches of an earlier run stay, and what
/// was begun is called `.part` until the next run replaces it.
pub fn animate(root: &Path, options: &AnimateOptions, observer: &dyn Observer) -> Result<Animated, PipelineError> {
    let fabrics = Fabrics::read(options.fabrics.as_deref())?;
    let building = Options { settings: options.settings.clone(), ..Options::default() };
    let summary = process(root, Goal::Avatar, &building, observer)?;
    let mut remarks = summary.remarks;
    remarks.warnings.extend(summary.notes);
    let settings = settings::read(Some(root), options.settings.as_deref())?;
    let run = Run::open(root, None, settings, observer)?;
    let model = BodyModel::load_default()?;
    let body = Body::load(&run.folders, run.first_layer(), &model)?;
    let choice = AvatarChoice::read(&run.folders)?;
    let garments = outfit::stacked(&run)?;
    let export = export::Export { run: &run, body: &body, garments: &garments, choice: &choice };
    let path = match &options.motion {
        MotionChoice::AsBefore => choice.motion_path(&run.folders),
        MotionChoice::Walk => None,
        MotionChoice::File(path) => Some(path.clone()),
    };
    let moved = export.moved(path.as_deref(), &export.dressed()?)?;
    let avatar = export.avatar()?;
    remarks.warnings.extend(moved.report.warnings.iter().map(|w| format!("motion {}: {w}", moved.motion.name)));
    let motion = resample(&moved.motion, options.fps);
    if motion.frame_time * options.fps > 1.01 {
        let (has, wanted) = (1.0 / motion.frame_time, options.fps);
        remarks
            .warnings
            .push(format!("the motion has {has:.1} frames a second; the caches have as many, not {wanted}"));
    }
    let folder = folder(&run, &motion)?;
    observer.begin(&run.label("layers", "animate"), SECONDS * (motion.poses.len() * garments.len().max(1)) as f64);
    let fabrics = fabrics.of(&avatar.layers)?;
    let (avatar, garments, fabrics, motion) = (&avatar, &garments[..], &fabrics[..], &motion);
    let baking = Baking { avatar, garments, fabrics, motion, options, folder: &folder, observer };
    let (report, said) = baking.run()?;
    observer.end();
    remarks.warnings.extend(said);
    remarks.warnings.extend(report.warnings());
    Ok(Animated { folder, report, remarks })
}

/// Where a motion's files lie.
fn folder(run: &Run, motion: &Motion) -> Result<PathBuf, PipelineError> {
    let all = run.folders.root.join("motion");
    // The name comes from a file: it must stay inside.
    match Path::new(&motion.name).components().next() {
        Some(Component::Normal(name)) if name == motion.name.as_str() => Ok(all.join(name)),
        _ => {
            let reason = format!("`{}` is no name for a folder; rename the motion's file", printable(&motion.name));
            Err(PipelineError::refused(&all, reason))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Settings, observer::Silent};

    #[test]
    fn a_motion_stays_inside_its_subject_whatever_its_file_is_called() {
        let run = Run::single(Path::new("/anna"), "anna", Settings::default(), &Silent);
        let named = |name: &str| folder(&run, &Motion { name: name.into(), frame_time: 0.1, poses: Vec::new() });
        assert_eq!(named("dance 2").unwrap(), Path::new("/anna/motion/dance 2"));
        for name in ["..", ".", "", "/etc", "a/b", "../x"] {
            assert!(named(name).unwrap_err().to_string().contains("no name for a folder"), "{name}");
        }
    }
}
