//! The motion of the avatar: a BVH file, or the walk that ships with Toile.

use std::path::Path;

use toile_animation::{AnimationError, Bvh, RetargetSettings, Retargeted, bvh, retarget, shipped_walk};
use toile_character::{BodyModel, Skeleton};

use crate::PipelineError;

/// Name of the clip when no motion was given.
pub const WALK: &str = "walk";

/// Reads the motion and carries it onto `skeleton`.
///
/// # Errors
/// [`PipelineError`] where the file is not a BVH file, or its skeleton is not a person's.
pub fn load(
    path: Option<&Path>,
    skeleton: &Skeleton,
    settings: &RetargetSettings,
) -> Result<Retargeted, PipelineError> {
    let (bvh, name) = match path {
        Some(path) => (read(path)?, path.file_stem().unwrap_or_default().to_string_lossy().into_owned()),
        None => (shipped_walk().map_err(|e| PipelineError::stage(Path::new(WALK), e))?, WALK.to_string()),
    };
    let at = path.unwrap_or(Path::new(WALK));
    retarget(&bvh, &name, skeleton, settings).map_err(|e| PipelineError::stage(at, e))
}

/// Checks a motion before any work is done: read it, and carry it onto the mean person.
///
/// # Errors
/// As [`load`].
pub fn check(path: &Path) -> Result<(), PipelineError> {
    load(Some(path), &BodyModel::load_default()?.mean_skeleton, &RetargetSettings::default()).map(drop)
}

fn read(path: &Path) -> Result<Bvh, PipelineError> {
    bvh::read(path).map_err(|e| match e {
        AnimationError::Io { path, source } => PipelineError::io(&path, source),
        // The line and the file's name are in the message already.
        AnimationError::Bvh { line, reason, .. } => PipelineError::format(path, format!("line {line}: {reason}")),
        AnimationError::File(error) => error.into(),
        other => PipelineError::stage(path, other),
    })
}
