//! Better poses once the whole take is known: the turn is closed, and every frame is registered to the whole.

use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use rayon::prelude::*;
use toile_geometry::Rigid;

use super::{
    closing::close,
    fuse_again::fuse_again,
    residuals::{residuals, settle},
};
use crate::{
    FusionError,
    field::Tsdf,
    frame::DepthView,
    report::FusionReport,
    take::Fuser,
    tracking::{DEGENERATE, Kept, register, samples},
};

/// Frames in the joint optimisation at most; of more, evenly spaced ones.
const MAX_CLOSED: usize = 100;
/// Frames in a round of refinement at most.
const MAX_REFINED: usize = 200;
/// Points of a frame that is registered to the whole.
const POINTS: usize = 6000;

/// Joint optimisation over key frames; frames between follow their neighbours. With the normals of the whole where it is
/// given: noise in blotches tilts those of single frames, which draws the frames together until the subject is too thin.
pub(crate) fn close_turn(fuser: &mut Fuser, whole: Option<&Tsdf>, report: &mut FusionReport) {
    let rounds = fuser.settings.closing_rounds;
    if rounds == 0 {
        return;
    }
    let keys = fuser.kept.key_frames(MAX_CLOSED);
    let kept = &fuser.kept;
    let view = |&i: &usize| {
        let mut view = kept.frames[i].view();
        if let Some(field) = whole {
            let found = residuals(&view, field, &kept.frames[i].model_from_camera, 1);
            settle(&mut view, &found, f32::INFINITY);
        }
        view
    };
    let views: Vec<DepthView> = keys.par_iter().map(view).collect();
    let sensors: Vec<usize> = keys.iter().map(|&i| kept.frames[i].sensor).collect();
    let mut poses: Vec<Rigid> = keys.iter().map(|&i| kept.frames[i].model_from_camera).collect();
    let closing = fuser.clock.time("close", || close(&views, &sensors, &mut poses, rounds));
    report.closing_pairs = closing.pairs;
    report.seam_pairs = closing.seam_pairs;
    report.seam_before_mm = closing.seam_before * 1e3;
    report.seam_after_mm = closing.seam_after * 1e3;
    follow(&mut fuser.kept, &keys, &poses);
}

/// The field of the key frames.
///
/// # Errors
/// [`FusionError::TooLarge`] where the field outgrows its index.
pub(crate) fn whole(fuser: &mut Fuser) -> Result<Tsdf, FusionError> {
    let keys = fuser.kept.key_frames(MAX_REFINED);
    fuse_again(fuser, &keys, false)
}

/// Registers each key frame to the whole, which is fused where it is not given.
///
/// # Errors
/// [`FusionError::TooLarge`] where the field outgrows its index.
pub(crate) fn refine(fuser: &mut Fuser, given: Option<Tsdf>) -> Result<(), FusionError> {
    let keys = fuser.kept.key_frames(MAX_REFINED);
    let field = match given {
        Some(field) => field,
        None => whole(fuser)?,
    };
    let kept = &fuser.kept;
    let registered = |&i: &usize| {
        let (view, before) = (kept.frames[i].view(), kept.frames[i].model_from_camera);
        let tracked = register(&field, &samples(&view, POINTS), &before);
        if tracked.overlap > 0.5 && tracked.conditioning > DEGENERATE { tracked.model_from_camera } else { before }
    };
    let poses: Vec<Rigid> = fuser.clock.time("refine", || keys.par_iter().map(registered).collect());
    let back = kept.frames[0].model_from_camera * poses[0].inverse();
    follow(&mut fuser.kept, &keys, &poses.iter().map(|pose| back * pose).collect::<Vec<_>>());
    Ok(())
}

/// Closes the turn of the frames so far, registers them to the whole and fuses the model again: for what follows to be
/// registered to it.
///
/// # Errors
/// [`FusionError::TooLarge`] where the field outgrows its index.
pub(crate) fn settle_poses(fuser: &mut Fuser) -> Result<(), FusionError> {
    close_turn(fuser, None, &mut FusionReport::default());
    if fuser.settings.refine_rounds > 0 {
        refine(fuser, None)?;
    }
    let all: Vec<usize> = (0..fuser.kept.len()).collect();
    fuser.model.field = fuse_again(fuser, &all, false)?;
    Ok(())
}

/// Gives the key frames new poses; the frames between follow their neighbours smoothly.
fn follow(kept: &mut Kept, keys: &[usize], poses: &[Rigid]) {
    let corrections: Vec<Rigid> =
        keys.iter().zip(poses).map(|(&i, pose)| pose * kept.frames[i].model_from_camera.inverse()).collect();
    let sensors: Vec<usize> = kept.frames.iter().map(|k| k.sensor).collect();
    for (i, frame) in kept.frames.iter_mut().enumerate() {
        let k = keys.partition_point(|key| *key <= i) - 1;
        // Behind a sensor's last key frame there is none to go to: the next one is another sensor's.
        let next = keys.get(k + 1).filter(|&&next| sensors[next] == sensors[i]);
        let (next, share) = next.map_or((k, 0.0), |next| (k + 1, (i - keys[k]) as f64 / (next - keys[k]) as f64));
        frame.model_from_camera = between(&corrections[k], &corrections[next], share) * frame.model_from_camera;
    }
}

/// The motion a share of the way from one to another.
fn between(a: &Rigid, b: &Rigid, share: f64) -> Rigid {
    let step = (a.rotation.inverse() * b.rotation).scaled_axis() * share;
    let rotation = a.rotation * UnitQuaternion::from_scaled_axis(step);
    Isometry3::from_parts(Translation3::from(a.translation.vector.lerp(&b.translation.vector, share)), rotation)
}
