//! All frames of a take, summed up.

use super::findings::{Gap, SensorInspection, TakeInspection};
use crate::{ColorImage, Frame, Rig, Source};

/// Sums over one sensor's frames.
#[derive(Default)]
struct Tally {
    valid: u64,
    pixels: u64,
    first_ns: Option<i64>,
    last_ns: i64,
}

/// Reads all frames of a source into `take`.
pub(super) fn read_frames(source: &mut dyn Source, take: &mut TakeInspection) {
    take.sensors = sensors(source.rig());
    let mut tallies: Vec<Tally> = take.sensors.iter().map(|_| Tally::default()).collect();
    loop {
        match source.next_frame() {
            Ok(None) => break,
            Ok(Some(frame)) => {
                take.frames += 1;
                if let (Some(sensor), Some(tally)) = (take.sensors.get_mut(frame.sensor), tallies.get_mut(frame.sensor))
                {
                    add_frame(sensor, tally, &frame);
                }
            }
            Err(error) => take.unreadable.push(error.to_string()),
        }
    }
    let first = tallies.iter().filter_map(|tally| tally.first_ns).min();
    let last = tallies.iter().filter(|tally| tally.first_ns.is_some()).map(|tally| tally.last_ns).max();
    take.duration_s = first.zip(last).map_or(0.0, |(first, last)| last.saturating_sub(first) as f64 * 1e-9);
    for (sensor, tally) in take.sensors.iter_mut().zip(&tallies) {
        sensor.depth_valid_share = if tally.pixels == 0 { 0.0 } else { tally.valid as f64 / tally.pixels as f64 };
        let seconds = tally.last_ns.saturating_sub(tally.first_ns.unwrap_or(0)) as f64 * 1e-9;
        let steps = (sensor.frames + sensor.lost_frames).saturating_sub(1) as f64;
        sensor.fps_measured = if seconds > 0.0 { steps / seconds } else { 0.0 };
    }
}

fn sensors(rig: &Rig) -> Vec<SensorInspection> {
    let one = |sensor: &crate::Sensor| SensorInspection {
        name: sensor.name.clone(),
        model: sensor.identity.model.clone(),
        serial: sensor.identity.serial.clone(),
        depth_size: [sensor.depth.width, sensor.depth.height],
        color_size: sensor.color.map(|color| [color.width, color.height]),
        fps_nominal: sensor.fps,
        ..SensorInspection::default()
    };
    rig.sensors.iter().map(one).collect()
}

fn add_frame(sensor: &mut SensorInspection, tally: &mut Tally, frame: &Frame) {
    sensor.frames += 1;
    sensor.lost_frames += u64::from(frame.lost_before);
    if frame.lost_before > 0 {
        sensor.gaps.push(Gap { before_frame: frame.device_frame, missing: frame.lost_before });
    }
    match &frame.depth {
        Some(depth) => {
            tally.pixels += depth.values.len() as u64;
            tally.valid += depth.values.iter().filter(|&&value| value != 0).count() as u64;
        }
        None => sensor.without_depth.push(frame.device_frame),
    }
    match (&frame.color, sensor.color_size) {
        (None, Some(_)) => sensor.without_color.push(frame.device_frame),
        (Some(color), size) if !is_whole(color, size) => sensor.damaged_color.push(frame.device_frame),
        _ => {}
    }
    if tally.first_ns.is_some() && frame.device_time_ns <= tally.last_ns {
        sensor.times_backwards.push(frame.device_frame);
    }
    tally.first_ns.get_or_insert(frame.device_time_ns);
    tally.last_ns = frame.device_time_ns;
}

/// True where a colour image can be decoded to its end and has the calibration's size.
fn is_whole(color: &ColorImage, size: Option<[u32; 2]>) -> bool {
    color.check().is_ok_and(|(width, height)| size.is_none_or(|size| size == [width, height]))
}
