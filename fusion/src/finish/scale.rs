//! The scale of a scan, where the true height of what was scanned is known.
//!
//! A sensor whose depth is too long by a share gives a world that is larger by that share in all directions, and nothing
//! within it tells so. A length that is known from elsewhere does.

use toile_geometry::{Mesh, Rigid};

use crate::{report::FusionReport, take::Fuser};

/// Heights that differ by more than this share are not of the same thing: depth cameras are less than 3 % off.
const FITS: f64 = 0.03;
/// A scale that is off by more than this share is said: 3 mm on a person, which hair may make.
const SAID: f64 = 0.002;

/// What the scan must be multiplied by so that its height is the known one; 1 where none is known, or where they do not
/// fit. Says so in the report.
pub(crate) fn known_scale(fuser: &Fuser, mesh: &Mesh, report: &mut FusionReport) -> f64 {
    report.height_m = mesh.positions.iter().map(|p| f64::from(p.y)).fold(0.0, f64::max);
    report.scaled_by = 1.0;
    let known = fuser.settings.known_height;
    if known <= 0.0 {
        return 1.0;
    }
    let measured = report.height_m;
    let heights = format!("the scan is {measured:.3} m high and the known height is {known:.3} m");
    let has_ground = fuser.volume.as_ref().is_some_and(|v| v.floor.is_some()) && fuser.settings.poses.is_none();
    let factor = known / measured.max(1e-3);
    if !has_ground || (factor - 1.0).abs() > FITS {
        let why = if has_ground { "they are not of the same thing" } else { "no floor is in view to measure from" };
        report.warnings.push(format!("{heights}: {why}, and nothing is scaled; see `fusion.known_height`"));
        return 1.0;
    }
    if (factor - 1.0).abs() > SAID {
        report.warnings.push(format!(
            "depth is {:.2} % too {}: {heights}; the scan is scaled to it. Set the sensor's depth scale to {factor:.4} times \
             what it is for other takes",
            (1.0 / factor - 1.0).abs() * 100.0,
            if factor < 1.0 { "long" } else { "short" },
        ));
    }
    report.scaled_by = factor;
    report.height_m = known;
    factor
}

/// A pose in a scan that was multiplied.
pub(crate) fn scaled(mut pose: Rigid, factor: f64) -> Rigid {
    pose.translation.vector *= factor;
    pose
}
