//! The scan's frame: upright on the disk, facing the first camera.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use toile_geometry::{Mesh, Rigid};

use crate::{
    Prior,
    report::FusionReport,
    take::Fuser,
    tracking::{Axis, find_axis, swept_turn, widest_step},
};

/// A turn of this many degrees is a full one.
const FULL_TURN_DEG: f64 = 340.0;
/// The step from the last frame on to the first is at most this many times as wide as the widest other one.
const ROUND_AGAIN: f64 = 1.3;
/// An axis is believed where frames turned about it by more than this, radians.
const AXIS_TURN: f64 = 0.5;

/// The transform `scan_from_model`; fills in the turn's part of the report.
pub(crate) fn place(fuser: &Fuser, raw: &Mesh, report: &mut FusionReport) -> Rigid {
    let (settings, volume) = (&fuser.settings, &fuser.volume);
    if settings.prior == Prior::None && volume.is_none() || settings.poses.is_some() {
        return Rigid::identity();
    }
    let poses: Vec<Rigid> = fuser.kept.leading().iter().map(|k| k.model_from_camera).collect();
    let found = find_axis(&poses);
    let turned = found.map_or(0.0, |a| swept_turn(&a, &poses));
    let widest = found.map_or(0.0, |a| widest_step(&a, &poses));
    report_turn(fuser, (turned, widest), report);
    // Without a volume the model's frame is the first camera's, whose +Y points down.
    let up = if volume.is_some() { Vector3::y() } else { -Vector3::y() };
    let has_floor = volume.as_ref().is_some_and(|v| v.floor.is_some());
    let axis = match found.filter(|_| turned.abs() > AXIS_TURN) {
        Some(found) => {
            let axis = found.pointing_along(&up);
            if volume.is_some() {
                report.axis_tilt_deg = Some(axis.direction.angle(&Vector3::y()).to_degrees());
            }
            axis
        }
        None => Axis { point: Point3::origin(), direction: up },
    };
    let lowest = raw.positions.iter().map(|p| p.coords.cast::<f64>().dot(&axis.direction));
    let ground = if has_floor { None } else { lowest.min_by(f64::total_cmp) };
    scan_from_model(&axis, &poses[0], ground)
}

/// Reports the turn from the first to the last frame, and the widest step in it, radians.
fn report_turn(fuser: &Fuser, (turned, widest): (f64, f64), report: &mut FusionReport) {
    let frames = fuser.kept.leading();
    let span = frames.last().map_or(0, |k| k.device_time_ns) - frames[0].device_time_ns;
    report.turned_deg = turned.abs().to_degrees();
    // Eight views in steps of 45° go all round, although the last one is 315° from the first.
    let goes_round = (TAU - turned.abs()) < ROUND_AGAIN * widest;
    report.full_turn = report.turned_deg >= FULL_TURN_DEG || goes_round;
    report.rate_deg_per_s = report.turned_deg / (span as f64 * 1e-9).max(1e-6);
}

/// The scan's frame from the axis, the first camera's pose and the ground's height along the axis (`None`: where the
/// model's own level zero meets the axis).
fn scan_from_model(axis: &Axis, first: &Rigid, ground: Option<f64>) -> Rigid {
    let y = axis.direction;
    let along = match ground {
        Some(g) => g - axis.point.coords.dot(&y),
        None => -axis.point.y / y.y.max(0.1),
    };
    let origin = axis.point + y * along;
    let toward = Point3::from(first.translation.vector) - origin;
    let z = (toward - y * y.dot(&toward)).try_normalize(1e-9).unwrap_or_else(Vector3::z);
    let rows = Rotation3::from_basis_unchecked(&[y.cross(&z), y, z]).transpose();
    let rotation = UnitQuaternion::from_rotation_matrix(&rows);
    Isometry3::from_parts(Translation3::from(-(rotation * origin.coords)), rotation)
}
