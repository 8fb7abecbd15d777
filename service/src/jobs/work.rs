//! What a job does: the same calls of the pipeline as the command line's.

use std::path::Path;

use toile_capture::Subject;
use toile_character::JointNaming;
use toile_garments::CullSettings;
use toile_pipeline::{
    AnimateOptions, Blend, Goal, HiddenChoice, MotionChoice, Observer, Options, PipelineError, Remarks, animate,
    process,
};

use super::job::{BlendName, JobOptions, Kind, MotionName, NamesName};

/// Does the work of one job on the subject at `root`.
///
/// # Errors
/// [`PipelineError`] of the stage that has no answer; what was done stays.
pub fn work(kind: Kind, root: &Path, options: &JobOptions, observer: &dyn Observer) -> Result<Remarks, PipelineError> {
    match kind {
        Kind::Process => {
            let dressed = options.dressed.unwrap_or(false);
            let chosen = Options { motion: motion(options), dressed, ..Options::default() };
            run(root, Goal::Report, &chosen, observer)
        }
        Kind::Rebuild => {
            must_have(root, options.layer.unwrap_or(0))?;
            run(root, Goal::Garments, &Options::default(), observer)
        }
        Kind::Animate => {
            let chosen = AnimateOptions {
                motion: motion(options),
                fps: options.fps.unwrap_or(30.0),
                blend: match options.blend {
                    Some(BlendName::Skinning) => Blend::Skinning,
                    _ => Blend::Anchored,
                },
                ..AnimateOptions::default()
            };
            animate(root, &chosen, observer).map(|animated| animated.remarks)
        }
        Kind::Export => {
            let joint_names = options.joint_names.map(|name| match name {
                NamesName::Vrm => JointNaming::Vrm,
                NamesName::Hanim => JointNaming::HAnim,
                NamesName::Mixamo => JointNaming::Mixamo,
            });
            let hidden = match options.cull_hidden {
                Some(true) => HiddenChoice::LeftOut(CullSettings::default()),
                Some(false) => HiddenChoice::Whole,
                None => HiddenChoice::AsBefore,
            };
            run(root, Goal::Avatar, &Options { joint_names, hidden, ..Options::default() }, observer)
        }
    }
}

fn motion(options: &JobOptions) -> MotionChoice {
    match options.motion {
        Some(MotionName::Walk) => MotionChoice::Walk,
        None => MotionChoice::AsBefore,
    }
}

fn run(root: &Path, goal: Goal, options: &Options, observer: &dyn Observer) -> Result<Remarks, PipelineError> {
    let summary = process(root, goal, options, observer)?;
    let mut remarks = summary.remarks;
    remarks.warnings.extend(summary.notes);
    Ok(remarks)
}

fn must_have(root: &Path, layer: usize) -> Result<(), PipelineError> {
    let layers = Subject::open(root)?.layers().len();
    if layer < layers {
        return Ok(());
    }
    Err(PipelineError::refused(
        root,
        format!("there is no layer {layer}; the last one is {}", layers.saturating_sub(1)),
    ))
}
