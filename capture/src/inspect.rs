//! What is in a recording, a folder or a subject, and whether it is healthy.

use std::{
    fmt::{self, Write},
    path::Path,
};

use serde::Serialize;

use crate::{
    CaptureError, Frame, Loss, Replay, Rig, Source, Subject,
    import::{self, Format, record::number_list},
};

/// Below this share of valid depth a sensor sees next to nothing.
const LEAST_VALID_SHARE: f64 = 0.02;
/// A measured rate this far (relative) from the nominal one is worth a word.
const RATE_TOLERANCE: f64 = 0.2;

/// What [`inspect`] found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Inspection {
    /// What was looked at.
    pub path: String,
    /// The subject's name and date, where it is one.
    pub subject: Option<SubjectInspection>,
    /// One entry a take; one for a single recording or folder.
    pub takes: Vec<TakeInspection>,
    /// True where no take has a problem.
    pub healthy: bool,
    /// True where recorded data was lost: a torn or damaged file, frames that are not readable.
    pub data_lost: bool,
}

/// A subject's head.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SubjectInspection {
    /// Its name.
    pub name: String,
    /// Date of the visit.
    pub date: String,
}

/// One recording or folder.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct TakeInspection {
    /// Layer label such as `01-trousers`, or the file's name.
    pub name: String,
    /// What garment it shows, where that is known.
    pub garment: Option<String>,
    /// `mcap`, or the layout of a folder.
    pub format: String,
    /// Size of the recording, bytes; 0 for folders.
    pub bytes: u64,
    /// Frames that can be read.
    pub frames: u64,
    /// Seconds from the first to the last frame, by the device's clock.
    pub duration_s: f64,
    /// Its sensors.
    pub sensors: Vec<SensorInspection>,
    /// What a torn or damaged file lost.
    pub loss: Option<Loss>,
    /// Frames that cannot be read, with the reason.
    pub unreadable: Vec<String>,
    /// What is wrong, a sentence each; empty where the take is healthy.
    pub problems: Vec<String>,
}

/// One sensor of a take.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct SensorInspection {
    /// Its name in the rig.
    pub name: String,
    /// Device model.
    pub model: String,
    /// Serial number.
    pub serial: String,
    /// Depth columns and rows.
    pub depth_size: [u32; 2],
    /// Colour columns and rows, where there is colour.
    pub color_size: Option<[u32; 2]>,
    /// Frames of this sensor.
    pub frames: u64,
    /// Nominal frames a second, 0 where unknown.
    pub fps_nominal: f64,
    /// Measured frames a second, by the device's clock (lost frames counted as if they were there).
    pub fps_measured: f64,
    /// Frames lost, by the device's numbers.
    pub lost_frames: u64,
    /// Where they are missing.
    pub gaps: Vec<Gap>,
    /// Device numbers of frames without depth.
    pub without_depth: Vec<u64>,
    /// Device numbers of frames without colour, where the sensor has colour.
    pub without_color: Vec<u64>,
    /// Share of depth pixels that are not 0, over all frames.
    pub depth_valid_share: f64,
    /// Device numbers of frames whose time is not later than the frame's before.
    pub times_backwards: Vec<u64>,
}

/// Frames missing in a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Gap {
    /// Device number of the first frame after the gap.
    pub before_frame: u64,
    /// How many are missing.
    pub missing: u32,
}

/// Looks through a recording, a folder of images, or all takes of a subject. Every depth image is decoded.
///
/// # Errors
/// [`CaptureError`] where nothing at all can be read.
pub fn inspect(path: &Path) -> Result<Inspection, CaptureError> {
    let (subject, takes) = if Subject::exists(path) {
        let subject = Subject::open(path)?;
        let head = SubjectInspection { name: subject.name().to_string(), date: subject.date().to_string() };
        (Some(head), inspect_layers(&subject))
    } else {
        (None, vec![inspect_take(path)?])
    };
    Ok(Inspection {
        path: path.display().to_string(),
        subject,
        healthy: takes.iter().all(|take| take.problems.is_empty()),
        data_lost: takes.iter().any(|take| take.loss.is_some() || !take.unreadable.is_empty()),
        takes,
    })
}

fn inspect_layers(subject: &Subject) -> Vec<TakeInspection> {
    let inspect_layer = |layer: &crate::Layer| {
        let path = subject.take_path(layer);
        let mut take = inspect_take(&path).unwrap_or_else(|error| TakeInspection {
            format: Format::Mcap.to_string(),
            unreadable: vec![error.to_string()],
            problems: vec![error.to_string()],
            ..TakeInspection::default()
        });
        take.name = layer.label();
        take.garment = layer.garment.clone();
        take
    };
    subject.layers().iter().map(inspect_layer).collect()
}

fn inspect_take(path: &Path) -> Result<TakeInspection, CaptureError> {
    let format = import::guess(path)?;
    let mut take = TakeInspection {
        name: path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned()),
        format: format.to_string(),
        ..TakeInspection::default()
    };
    if format == Format::Mcap {
        let mut replay = Replay::open(path)?;
        take.loss = replay.lost().cloned();
        take.bytes = std::fs::metadata(path).map_err(|error| CaptureError::io(path, error))?.len();
        read_frames(&mut replay, &mut take);
    } else {
        read_frames(import::open(path, Some(format))?.as_mut(), &mut take);
    }
    take.problems = problems(&take);
    Ok(take)
}

/// What is summed up over one sensor's frames.
#[derive(Default)]
struct Tally {
    valid: u64,
    pixels: u64,
    first_ns: Option<i64>,
    last_ns: i64,
}

fn read_frames(source: &mut dyn Source, take: &mut TakeInspection) {
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
    if frame.color.is_none() && sensor.color_size.is_some() {
        sensor.without_color.push(frame.device_frame);
    }
    if tally.first_ns.is_some() && frame.device_time_ns <= tally.last_ns {
        sensor.times_backwards.push(frame.device_frame);
    }
    tally.first_ns.get_or_insert(frame.device_time_ns);
    tally.last_ns = frame.device_time_ns;
}

fn problems(take: &TakeInspection) -> Vec<String> {
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
        (&sensor.times_backwards, "are not later than the frame before"),
    ];
    for (numbers, what) in lists.iter().filter(|(numbers, _)| !numbers.is_empty()) {
        say(format!("{} frames {what}: {}", numbers.len(), number_list(numbers)));
    }
    if sensor.depth_valid_share < LEAST_VALID_SHARE {
        say(format!("only {:.1} % of the depth pixels are measured", 100.0 * sensor.depth_valid_share));
    }
    let (nominal, measured) = (sensor.fps_nominal, sensor.fps_measured);
    if nominal > 0.0 && measured > 0.0 && (measured / nominal - 1.0).abs() > RATE_TOLERANCE {
        say(format!("runs at {measured:.1} frames a second instead of {nominal:.1}"));
    }
}

impl fmt::Display for Inspection {
    /// The report for people; several lines.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut text = String::new();
        match &self.subject {
            Some(subject) => writeln!(text, "{}: subject {}, {}", self.path, subject.name, subject.date)?,
            None => writeln!(text, "{}", self.path)?,
        }
        if self.takes.is_empty() {
            writeln!(text, "  no takes yet")?;
        }
        for take in &self.takes {
            write_take(&mut text, take)?;
        }
        f.write_str(text.trim_end())
    }
}

fn write_take(text: &mut String, take: &TakeInspection) -> fmt::Result {
    let garment = take.garment.as_ref().map_or_else(String::new, |garment| format!(" ({garment})"));
    let size = if take.bytes > 0 { format!(", {:.1} MB", take.bytes as f64 * 1e-6) } else { String::new() };
    writeln!(
        text,
        "  {}{garment}: {}, {} frames, {:.1} s{size}",
        take.name, take.format, take.frames, take.duration_s
    )?;
    for sensor in &take.sensors {
        let [width, height] = sensor.depth_size;
        let color = sensor.color_size.map_or_else(|| "no colour".to_string(), |[w, h]| format!("colour {w} x {h}"));
        let identity = [&sensor.model, &sensor.serial].map(String::as_str).join(" ");
        writeln!(
            text,
            "    {} [{}]: depth {width} x {height}, {color}, {} frames at {:.1} a second, {} lost, {:.0} % of depth valid",
            sensor.name,
            identity.trim(),
            sensor.frames,
            sensor.fps_measured,
            sensor.lost_frames,
            100.0 * sensor.depth_valid_share
        )?;
    }
    for problem in &take.problems {
        writeln!(text, "    ! {problem}")?;
    }
    if take.problems.is_empty() {
        writeln!(text, "    healthy")?;
    }
    Ok(())
}
