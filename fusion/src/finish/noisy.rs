//! Takes whose noise is wide against the band: poses and surface from the pixels' distances to the whole along their rays.
//!
//! A band that is narrow against the noise cuts it on one side alone: what is measured too far in front of a voxel counts as
//! free, what is measured too far behind does not count, so that subjects come out too thin. A wider band swallows fingers.
//! Here each pixel is compared with the whole along its ray and counts as at most so far from it, on both sides alike.

use nalgebra::Point3;
use rayon::prelude::*;
use toile_geometry::Rigid;

use super::{
    fuse_again::{GROUP, colored_view},
    noise::Noise,
    poses::close_turn,
    residuals::{Residual, equations, residuals, settle},
};
use crate::{
    FusionError,
    field::{Tsdf, integrate},
    frame::DepthView,
    report::FusionReport,
    settings::FusionSettings,
    take::{Fuser, NOISE_BAND},
};

/// Rounds in which all frames are fused again and, from the second on, registered to the whole along their rays.
const ROUNDS: usize = 2;
/// Robust standard deviations at which Tukey's kernel of a registration ends.
const TUKEY: f32 = 4.7;
/// Noise need not fit into the band here: half of it to one side is enough for the mean to follow the middle.
const BAND: f64 = 2.5;

/// True where the noise, somewhere, is too wide for the band that is set.
pub(crate) fn is_wide(noise: &Noise, settings: &FusionSettings) -> bool {
    NOISE_BAND * noise.widest > settings.truncation
}

/// The field of the scan from `whole`, the field of closed poses.
///
/// # Errors
/// [`FusionError::TooLarge`] where a field outgrows its index.
pub(crate) fn fuse_noisy(
    fuser: &mut Fuser,
    whole: Tsdf,
    noise: &Noise,
    report: &mut FusionReport,
) -> Result<Tsdf, FusionError> {
    if fuser.finds_poses() {
        close_turn(fuser, Some(&whole), report);
    }
    fuser.model.set_band(BAND * noise.sigma);
    let mut field = whole;
    for round in 0..ROUNDS {
        // The first field is that of the poses before: nothing is registered to it.
        let gate = if round == 0 || !fuser.finds_poses() { 0.0 } else { TUKEY * noise.widest as f32 };
        let (next, poses) = settle_all(fuser, &field, gate, false)?;
        field = next;
        if !fuser.finds_poses() {
            continue;
        }
        let back = poses.first().map_or_else(Rigid::identity, |p| fuser.kept.frames[0].model_from_camera * p.inverse());
        fuser.kept.frames.iter_mut().zip(&poses).for_each(|(kept, pose)| kept.model_from_camera = back * pose);
    }
    Ok(settle_all(fuser, &field, 0.0, true)?.0)
}

/// Fuses all frames again as compared with a field; and their poses when they are registered to it, with residuals up to
/// `gate` metres.
fn settle_all(fuser: &mut Fuser, field: &Tsdf, gate: f32, with_color: bool) -> Result<(Tsdf, Vec<Rigid>), FusionError> {
    let with_color = with_color && fuser.kept.has_color();
    let mut next = fuser.model.empty_field(with_color).weighed_evenly();
    let mut poses = Vec::with_capacity(fuser.kept.len());
    let all: Vec<usize> = (0..fuser.kept.len()).collect();
    let colored = fuser.kept.colored_step();
    let (kept, sensors) = (&fuser.kept.frames, &fuser.sensors);
    for group in all.chunks(GROUP) {
        let one = |&i: &usize| {
            let sensor = &sensors[kept[i].sensor];
            let mut view = colored_view(&kept[i], sensor, with_color && i.is_multiple_of(colored));
            let pose = kept[i].model_from_camera;
            let found = residuals(&view, field, &pose, 1);
            settle(&mut view, &found, field.truncation());
            let pose = registered(&view, &found, &pose, gate);
            (view, pose)
        };
        let settled: Vec<(DepthView, Rigid)> = fuser.clock.time("settle", || group.par_iter().map(one).collect());
        for (&i, (view, pose)) in group.iter().zip(&settled) {
            fuser.clock.time("integrate again", || integrate(&mut next, view, &kept[i].model_from_camera))?;
            poses.push(*pose);
        }
    }
    Ok((next, poses))
}

/// The pose of a frame after one step towards the whole.
fn registered(view: &DepthView, found: &[Residual], pose: &Rigid, gate: f32) -> Rigid {
    let center = Point3::from(pose.translation.vector);
    equations(view, found, pose, &center, gate).step(&center, 1e-6).motion * pose
}
