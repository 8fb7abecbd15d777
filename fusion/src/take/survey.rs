//! Where the subject is, by frames of one sensor spread over the take.

use rayon::prelude::*;
use toile_capture::{Frame, Rig};

use super::preparer::{Filter, usable_sensor};
use crate::{
    FusionError, FusionSettings,
    subject::{SURVEY_FRAMES, SubjectVolume, find_volume},
};

/// Finds the subject's volume in frames of the first sensor, spread over the take.
///
/// # Errors
/// [`FusionError::NobodyInIt`], or a calibration that cannot be used.
pub fn survey(rig: &Rig, frames: &[Frame], settings: &FusionSettings) -> Result<SubjectVolume, FusionError> {
    survey_sensor(rig, 0, frames, settings)
}

/// The same in frames of any sensor.
///
/// # Errors
/// Those of [`survey`].
pub(crate) fn survey_sensor(
    rig: &Rig,
    sensor: usize,
    frames: &[Frame],
    settings: &FusionSettings,
) -> Result<SubjectVolume, FusionError> {
    let filter = Filter::new(usable_sensor(rig, sensor)?, settings);
    let with_depth: Vec<&Frame> = frames.iter().filter(|f| f.depth.is_some()).collect();
    let step = with_depth.len().div_ceil(SURVEY_FRAMES).max(1);
    let chosen: Vec<&Frame> = with_depth.into_iter().step_by(step).collect();
    let depths: Vec<Vec<f32>> = chosen.par_iter().filter_map(|f| filter.apply(f)).collect();
    find_volume(&filter.rectifier.camera, &depths)
}
