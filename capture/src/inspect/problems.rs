//! Problems of a take.

use super::findings::{SensorInspection, TakeInspection};
use crate::import::number_list;

/// Below this share of valid depth a sensor sees almost nothing.
const MIN_VALID_SHARE: f64 = 0.02;
/// A measured rate that differs by more than this (relative) from the nominal one is reported.
const RATE_TOLERANCE: f64 = 0.2;

/// Problems of a take, a sentence each.
pub(super) fn problems(take: &TakeInspection) -> Vec<String> {
    let mut problems = Vec::new();
    if let Some(loss) = &take.loss {
        problems.push(loss.to_string());
    }
    if let Some(first) = take.unreadable.first() {
        problems.push(format!("{} frames cannot be read; the first: {first}", take.unreadable.len()));
    }
    for sensor in &take.sensors {
        sensor_problems(sensor, &mut problems);
    }
    problems
}

fn sensor_problems(sensor: &SensorInspection, problems: &mut Vec<String>) {
    let mut say = |text: String| problems.push(format!("{}: {text}", sensor.name));
    if sensor.frames == 0 {
        return say("gave no frames".to_string());
    }
    if sensor.lost_frames > 0 {
        let share = 100.0 * sensor.lost_frames as f64 / (sensor.frames + sensor.lost_frames) as f64;
        say(format!("{} frames lost ({share:.1} %) in {} gaps", sensor.lost_frames, sensor.gaps.len()));
    }
    let lists = [
        (&sensor.without_depth, "have no depth"),
        (&sensor.without_color, "have no colour"),
        (&sensor.damaged_color, "have a damaged colour image"),
        (&sensor.times_backwards, "are not later than the frame before"),
    ];
    for (numbers, what) in lists.iter().filter(|(numbers, _)| !numbers.is_empty()) {
        say(format!("{} frames {what}: {}", numbers.len(), number_list(numbers)));
    }
    if sensor.depth_valid_share < MIN_VALID_SHARE {
        say(format!("only {:.1} % of the depth pixels are measured", 100.0 * sensor.depth_valid_share));
    }
    let (nominal, measured) = (sensor.fps_nominal, sensor.fps_measured);
    if nominal > 0.0 && measured > 0.0 && (measured / nominal - 1.0).abs() > RATE_TOLERANCE {
        say(format!("runs at {measured:.1} frames a second instead of {nominal:.1}"));
    }
}
