//! The end of a take: the turn is closed, everything is fused again, the surface becomes the scan.

use toile_geometry::Mesh;

use super::{
    clean_up::clean_up,
    fuse_again::final_field,
    noise::{Noise, measure},
    noisy::{fuse_noisy, is_wide},
    placing::place,
    poses::{close_turn, refine, whole},
    scale::{known_scale, scaled},
    summary::{FieldSize, summarise},
};
use crate::{
    FusionError, Prior, Scan, TrackedFrame,
    field::{Tsdf, crossings, tidy},
    report::FusionReport,
    settings::FusionSettings,
    take::Fuser,
};

/// Weight units that make a voxel surface: two frames at the most grazing angle.
const MIN_WEIGHT: u16 = 2;
/// The same for each frame of a subject that turns before a resting camera, which sees every place in a fixed share of the
/// frames: one frame in fifty at the most grazing angle. Flying pixels and the noise over the disk come with every frame,
/// so the weight that makes a surface must grow with the number of frames.
const MIN_WEIGHT_A_FRAME: f64 = 0.02;

/// Frames of a usual turn (100) that see a place, without those that see it very obliquely.
const SEEN_IN_A_TURN: f64 = 30.0;
/// A subject that stands still is smoothed by at most so many times the passes.
const MOST_SMOOTHING: f64 = 4.0;

/// Closes the turn, fuses everything again and makes the scan.
///
/// # Errors
/// [`FusionError::NotTracked`] where fewer than three frames were fused, and [`FusionError::NobodyInIt`] where they make no
/// surface.
pub fn finish(mut fuser: Fuser, progress: &(dyn Fn(f32) + Sync)) -> Result<Scan, FusionError> {
    check_enough_frames(&fuser)?;
    let mut report = FusionReport { settings: fuser.settings.clone(), ..FusionReport::default() };
    report.settings.poses = None;
    report.stands_still = fuser.stands_still;
    if fuser.finds_poses() {
        close_turn(&mut fuser, None, &mut report);
        progress(0.3);
    }
    let field = match look(&mut fuser, &mut report)? {
        Some((whole, noise)) if is_wide(&noise, &fuser.settings) => fuse_noisy(&mut fuser, whole, &noise, &mut report)?,
        looked => {
            let rounds = if looked.is_some() && fuser.finds_poses() { fuser.settings.refine_rounds } else { 0 };
            let mut first = looked.map(|(whole, _)| whole);
            for round in 0..rounds {
                refine(&mut fuser, first.take())?;
                progress(0.3 + 0.2 * (round + 1) as f32 / rounds as f32);
            }
            final_field(&mut fuser)?
        }
    };
    progress(0.7);
    let size = FieldSize { blocks: field.block_count(), bytes: field.bytes(), truncation: field.truncation() };
    let raw = extract(&mut fuser, field)?;
    report.triangles_raw = raw.triangles.len();
    let scan_from_model = place(&fuser, &raw, &mut report);
    let mesh = raw.transformed(&scan_from_model);
    drop(raw);
    let mut mesh = clean(&mut fuser, mesh, &mut report);
    let scale = known_scale(&fuser, &mesh, &mut report);
    mesh.positions.iter_mut().for_each(|p| *p *= scale as f32);
    progress(1.0);
    let timings = summarise(&mut fuser, &size, &mut report);
    let trajectory = fuser.kept.frames.into_iter().map(|k| TrackedFrame {
        sensor: k.sensor,
        index: k.index,
        device_time_ns: k.device_time_ns,
        scan_from_camera: scaled(scan_from_model * k.model_from_camera, scale),
        tracked: k.tracked,
    });
    Ok(Scan { mesh, trajectory: trajectory.collect(), report, timings })
}

/// Looks at the noise against the whole; the whole's field goes on. `None` where poses are not to be refined.
fn look(fuser: &mut Fuser, report: &mut FusionReport) -> Result<Option<(Tsdf, Noise)>, FusionError> {
    if fuser.settings.poses.is_some() || fuser.settings.refine_rounds == 0 {
        return Ok(None);
    }
    let whole = whole(fuser)?;
    let noise = measure(fuser, &whole);
    noise.enter(report);
    Ok(Some((whole, noise)))
}

fn check_enough_frames(fuser: &Fuser) -> Result<(), FusionError> {
    let least = if fuser.log.seen < 3 { 1 } else { 3 };
    if fuser.kept.len() >= least {
        return Ok(());
    }
    let reason = fuser.log.dropped.first().map_or_else(|| "too few frames".into(), |d| d.reason.to_string());
    Err(FusionError::NotTracked { reason, tracked: fuser.kept.len(), frames: fuser.log.seen })
}

/// The raw surface, model frame.
fn extract(fuser: &mut Fuser, field: Tsdf) -> Result<Mesh, FusionError> {
    let turning = fuser.volume.is_some();
    // Each place of a subject that stands still is seen by one or two sensors, in all their frames.
    let frames = if fuser.stands_still { fuser.kept.leading().len() } else { fuser.kept.len() };
    let minimum_weight = minimum_weight(&fuser.settings, turning, frames);
    let raw = fuser.clock.time("extract", || {
        let crossings = crossings(&field, minimum_weight);
        drop(field);
        tidy(&crossings)
    });
    if raw.triangles.is_empty() {
        return Err(FusionError::NobodyInIt { reason: "the fused frames make no surface".into() });
    }
    Ok(raw)
}

/// Weight units that make a voxel surface. A hand-held camera sees a place in a few of its frames only.
pub(crate) fn minimum_weight(settings: &FusionSettings, is_cut_out: bool, frames: usize) -> u16 {
    let turning = is_cut_out && settings.prior == Prior::Turntable;
    let share = if turning { (MIN_WEIGHT_A_FRAME * frames as f64) as u16 } else { 0 };
    share.max(MIN_WEIGHT)
}

/// Passes of smoothing: as set, and more where a subject that stands still is seen in fewer frames than one that turns.
/// What noise is left falls with the root of the frames, and with the passes about as fast.
fn smoothing_passes(fuser: &Fuser) -> usize {
    let passes = fuser.settings.smoothing_passes;
    if !fuser.stands_still {
        return passes;
    }
    let frames = fuser.kept.leading().len().max(1) as f64;
    (passes as f64 * (SEEN_IN_A_TURN / frames).sqrt().clamp(1.0, MOST_SMOOTHING)).round() as usize
}

fn clean(fuser: &mut Fuser, mesh: Mesh, report: &mut FusionReport) -> Mesh {
    let settings = FusionSettings { smoothing_passes: smoothing_passes(fuser), ..fuser.settings.clone() };
    // Known poses keep their own frame, whose zero is not the floor.
    let on_floor = fuser.volume.as_ref().filter(|v| v.floor.is_some() && settings.poses.is_none());
    let cut = on_floor.and_then(|v| v.bottom).map(|bottom| bottom as f32);
    let (mesh, cleaned) = fuser.clock.time("clean up", || clean_up(mesh, &settings, cut));
    report.triangles = mesh.triangles.len();
    report.holes_filled = cleaned.holes;
    report.filled_percent = cleaned.filled_percent;
    report.watertight = cleaned.watertight;
    mesh
}
