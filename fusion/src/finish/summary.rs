//! The final report and timings.

use toile_geometry::{lanes::instruction_set, statistics::median};

use crate::{
    drop_reason::DropReason,
    field::VOXELS,
    report::{FusionReport, VolumeReport},
    rig::{rig_warnings, settle},
    settings::KNOWN_POSE_WITHIN_NS,
    take::{Fuser, NOISE_BAND},
    timings::Timings,
};

/// An axis farther than this from the upright of the image means that the camera lies on its side, degrees.
const LYING_DEG: f64 = 45.0;
/// Noise whose pixels four apart agree by more than this comes in blotches (correlation).
const BLOTCHY: f64 = 0.3;
/// A floor that is seen bent by more than this is said, millimetres: generated takes of flat floors with true lenses give 0.0,
/// one of k1 0.09, k2 -0.27, k3 0.095 that the calibration does not tell 8.4.
const BENT_FLOOR_MM: f64 = 1.0;
/// A seam wider than this means that the subject moved, millimetres.
const OPEN_SEAM_MM: f64 = 5.0;

/// Figures of the final field, for the report.
pub(crate) struct FieldSize {
    pub blocks: usize,
    pub bytes: usize,
    pub truncation: f32,
}

/// Fills in what the report says about frames, volume and noise, with its warnings; the timings.
pub(crate) fn summarise(fuser: &mut Fuser, field: &FieldSize, report: &mut FusionReport) -> Timings {
    report.frames_seen = fuser.log.seen;
    report.frames_fused = fuser.kept.len();
    report.dropped = std::mem::take(&mut fuser.log.dropped);
    report.sensors_not_used = std::mem::take(&mut fuser.log.sensors_not_used);
    report.sensors = settle(fuser);
    report.volume = fuser.volume.as_ref().map(|v| VolumeReport {
        radius_m: v.radius,
        floor_found: v.floor.is_some(),
        bottom_m: v.bottom.unwrap_or(0.0),
        axis_distance_m: v.model_from_camera.translation.vector.xz().norm(),
        image_up: v.image_up,
        floor_bend_mm: v.floor.as_ref().map(|f| f.bend * 1e3),
    });
    report.noise_mm = fuser.model.noise * 1e3;
    report.truncation_mm = f64::from(field.truncation) * 1e3;
    summarise_tracking(fuser, report);
    let mut list = warnings(report);
    list.extend(depth_warnings(report));
    list.append(&mut report.warnings);
    report.warnings = list;
    let leader = &fuser.sensors[fuser.kept.leading()[0].sensor].name;
    report.warnings.extend(rig_warnings(&report.sensors, leader));
    timings(fuser, field)
}

fn summarise_tracking(fuser: &Fuser, report: &mut FusionReport) {
    let tracked = || fuser.kept.frames.iter().filter_map(|k| k.tracked);
    let mut residuals: Vec<f64> = tracked().map(|t| t.residual * 1e3).collect();
    report.residual_max_mm = residuals.iter().copied().max_by(f64::total_cmp).unwrap_or(0.0);
    report.residual_mm = median(&mut residuals).unwrap_or(0.0);
    report.conditioning_least = tracked().map(|t| t.conditioning).min_by(f64::total_cmp).unwrap_or(0.0);
    report.frames_by_color = tracked().filter(|t| t.by_color).count();
}

fn timings(fuser: &Fuser, field: &FieldSize) -> Timings {
    let (frames, touched) = (fuser.kept.len().max(1), fuser.model.touched);
    Timings {
        blocks: field.blocks,
        voxels: field.blocks * VOXELS,
        voxels_touched_per_frame: touched.voxels / frames,
        voxels_updated_per_frame: touched.updated / frames,
        simd: instruction_set().into(),
        field_bytes: field.bytes,
        ..fuser.clock.timings()
    }
}

/// Warnings about the depth itself.
fn depth_warnings(report: &FusionReport) -> Vec<String> {
    let mut list = Vec::new();
    if NOISE_BAND * report.noise_widest_mm > report.settings.truncation * 1e3 {
        let blotchy =
            if report.noise_correlation > BLOTCHY { "; it comes in blotches, which averages out slowly" } else { "" };
        list.push(format!(
            "depth is noisy: {:.1} mm, {:.1} mm where it is worst (dark or distant cloth){blotchy}; more frames, a nearer \
             sensor or brighter cloth help",
            report.noise_whole_mm, report.noise_widest_mm
        ));
    }
    let bend = report.volume.as_ref().and_then(|v| v.floor_bend_mm).filter(|mm| *mm > BENT_FLOOR_MM);
    if let Some(mm) = bend {
        list.push(format!(
            "the floor is seen bent by {mm:.1} mm, as through a lens whose distortion the calibration does not tell (or it is \
             uneven): calibrate the sensor, and record again; shapes may be off by millimetres"
        ));
    }
    list
}

fn warnings(report: &FusionReport) -> Vec<String> {
    let mut list = Vec::new();
    if !report.sensors_not_used.is_empty() {
        let names = report.sensors_not_used.join("`, `");
        list.push(format!("the depth of `{names}` is not in the scan: where it stands in the rig is not known"));
    }
    if report.volume.is_some() && !report.full_turn && report.turned_deg > 0.0 {
        list.push(format!("the turn is not full: {:.0}° of 360°; the far side is filled, not seen", report.turned_deg));
    }
    if report.volume.as_ref().is_some_and(|v| !v.floor_found) && report.axis_tilt_deg.is_some_and(|t| t > LYING_DEG) {
        list.push(
            "the subject turned about an axis that lies across the image, and no floor is in view that says which side \
             is up: the scan may be upside down; turn the camera upright or let it see the floor"
                .into(),
        );
    }
    let unknown = report.dropped.iter().filter(|d| d.reason == DropReason::NoKnownPose).count();
    if unknown > 0 {
        let within = KNOWN_POSE_WITHIN_NS / 1_000_000;
        list.push(format!(
            "{unknown} of {} frames have no known pose within {within} ms and are left out",
            report.frames_seen
        ));
    }
    let lost = report.frames_seen.saturating_sub(report.frames_fused + unknown);
    if lost * 20 > report.frames_seen {
        list.push(format!("{lost} of {} frames could not be used", report.frames_seen));
    }
    if report.seam_after_mm > OPEN_SEAM_MM {
        list.push(format!("the turn closes only to {:.1} mm: the subject moved", report.seam_after_mm));
    }
    list
}
