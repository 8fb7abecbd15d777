//! The report on a rig, once all poses are known.

use nalgebra::Point3;
use toile_geometry::Rigid;

use super::{
    found::FoundSensor,
    path::Path,
    place::{Subject, apart},
};
use crate::{
    report::{MovedReport, SensorReport},
    take::Fuser,
};

/// Quartz clocks keep to this, parts in a million; one that runs away farther is said.
const QUARTZ_PPM: f64 = 200.0;
/// A sensor that stands farther from where the recording says is said, metres and degrees: more than a tape measure's error.
const DEPARTS: (f64, f64) = (0.04, 2.0);

/// The report on each sensor of the rig, in its order, once all poses are known; nothing for a single sensor.
pub(crate) fn settle(fuser: &Fuser) -> Vec<SensorReport> {
    if fuser.sensors.len() < 2 || fuser.rig.sensors.is_empty() {
        return Vec::new();
    }
    let leading = fuser.kept.leading();
    let (leader, first) = (leading[0].sensor, leading[0].model_from_camera);
    let path = Path::new(leading.iter().map(|k| (k.time_ns, k.model_from_camera)));
    let rig_from_room = fuser.sensors[leader].rig_from_depth * first.inverse();
    let report = |(index, sensor): (usize, &toile_capture::Sensor)| {
        let mut report = SensorReport { name: sensor.name.clone(), ..SensorReport::default() };
        let frames = || fuser.kept.frames.iter().filter(|k| k.sensor == index);
        report.frames_fused = frames().count();
        if index == leader {
            report.frames_seen = fuser.log.leading_seen;
            report.noise_mm = fuser.model.noise * 1e3;
            report.clock_drift_ppm = fuser.rig.leading_ppm;
            (report.position_m, report.rotation_deg) = numbers(&sensor.rig_from_depth);
            report.is_placed = true;
            return report;
        }
        let Some(found) = fuser.rig.sensors.iter().find(|f| f.sensor == index) else { return report };
        let places: Vec<Rigid> = frames().map(|k| path.at(k.time_ns).inverse() * k.model_from_camera).collect();
        fill(&mut report, found, &places);
        let rig_from_depth = rig_from_room * found.room_from_camera;
        (report.position_m, report.rotation_deg) = numbers(&rig_from_depth);
        let (shift, angle) = apart(&sensor.rig_from_depth, &rig_from_depth);
        (report.departs_mm, report.departs_deg) = (shift * 1e3, angle);
        report
    };
    fuser.sensors.iter().enumerate().map(report).collect()
}

fn fill(report: &mut SensorReport, found: &FoundSensor, places: &[Rigid]) {
    let subject = Subject { center: Point3::new(0.0, 0.9, 0.0) };
    let mut off: Vec<f64> = places.iter().map(|p| subject.distance(p, &found.room_from_camera)).collect();
    report.is_placed = true;
    report.frames_seen = found.frames_seen;
    report.noise_mm = found.noise * 1e3;
    report.clock_drift_ppm = found.drift_ppm;
    report.spread_mm = toile_geometry::statistics::median(&mut off).unwrap_or(0.0) * 1e3;
    report.clock_is_unsteady = found.by_arrival;
    report.moved = found.push.map(|(push, at_s)| MovedReport {
        after_s: at_s,
        shift_mm: push.moved.0 * 1e3,
        angle_deg: push.moved.1,
    });
}

/// Position (metres) and rotation (axis times angle, degrees), as a rig file has them.
fn numbers(pose: &Rigid) -> ([f64; 3], [f64; 3]) {
    let turn = pose.rotation.scaled_axis().map(f64::to_degrees);
    (pose.translation.vector.into(), turn.into())
}

/// What the operator should know about the sensors.
pub(crate) fn rig_warnings(reports: &[SensorReport], leader: &str) -> Vec<String> {
    let mut list = Vec::new();
    let placed = || reports.iter().filter(|r| r.is_placed);
    for r in placed() {
        let name = &r.name;
        if r.clock_is_unsteady {
            list.push(format!("the clock of `{name}` jumps; its frames are placed by when they arrived"));
        } else if r.clock_drift_ppm.abs() > QUARTZ_PPM {
            let ppm = r.clock_drift_ppm;
            list.push(format!(
                "the clock of `{name}` runs {ppm:.0} millionths off the host's; its frames are placed by the host's"
            ));
        }
        if let Some(moved) = &r.moved {
            list.push(format!(
                "`{name}` and `{leader}` moved against each other by {:.0} mm and {:.1}° after {:.0} s of the take: one of them was \
                 knocked; calibrate the rig again",
                moved.shift_mm, moved.angle_deg, moved.after_s
            ));
        } else if r.departs_mm > DEPARTS.0 * 1e3 || r.departs_deg > DEPARTS.1 {
            list.push(format!(
                "`{name}` stands {:.0} mm and {:.1}° from where the rig's calibration says; `toile calibrate` finds where",
                r.departs_mm, r.departs_deg
            ));
        }
    }
    list
}
