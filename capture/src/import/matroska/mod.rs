//! Matroska recordings (`.mkv`) of k4arecorder and of what records as it does (Orbbec's wrapper of the same interface, Open3D's
//! recorder): depth as `b16g`, colour as JPEG or raw, the calibration attached, how both were taken in tags.
//!
//! Times are the device's: those of the blocks and the offset that a tag states. Depth may be taken a stated time after
//! colour; pictures pair as if it were not, and keep their own times.

mod calibration;
mod ebml;
mod segment;
mod track;

use std::{fs::File, path::Path};

use toile_geometry::Rigid;

use super::stored::{Album, Shot, StoredSource, fps, numbered, shots};
use crate::{CaptureError, ColorImage, DepthImage, DeviceIdentity, Rig, Sensor, files::open_regular, printable};
use calibration::Calibration;
use ebml::Ebml;
use segment::{Block, Segment};
use track::Track;

/// What a Matroska file starts with.
pub(super) const MAGIC: &[u8] = b"\x1a\x45\xdf\xa3";
const DEPTH_FORMATS: [&str; 1] = ["b16g"];
const COLOR_FORMATS: [&str; 4] = ["MJPG", "NV12", "YUY2", "BGRA"];

/// Opens a recording.
///
/// # Errors
/// [`CaptureError`] that says what is wrong, or which kind of it is not read.
pub(super) fn open(path: &Path) -> Result<StoredSource, CaptureError> {
    let wrong = |reason: String| CaptureError::format(path, reason);
    let mut file = Ebml::new(open_regular(path)?).map_err(wrong)?;
    let mut segment = Segment::read(&mut file).map_err(wrong)?;
    let choice = choose(&segment).map_err(wrong)?;
    let mut remarks = std::mem::take(&mut segment.losses);
    remarks.extend(choice.remarks);
    let of = |track: Option<&Track>| -> Vec<Block> {
        let number = track.map(|track| track.number);
        segment.blocks.iter().filter(|block| Some(block.track) == number).copied().collect()
    };
    let (depth, color) = (of(Some(&choice.depth)), of(choice.color.as_ref()));
    let shots = paired(&depth, &color, whole(&segment, "K4A_START_OFFSET_NS"), whole(&segment, "K4A_DEPTH_DELAY_NS"));
    let period_ns = choice.depth.period_ns as i64;
    let (shots, missing) = numbered(shots, period_ns);
    let text = |name: &str| printable(segment.tag(name).unwrap_or_default()).into_owned();
    let identity = DeviceIdentity {
        model: "import:mkv".into(),
        serial: text("K4A_DEVICE_SERIAL_NUMBER"),
        firmware: text("K4A_DEPTH_FIRMWARE_VERSION"),
        ..DeviceIdentity::default()
    };
    let Calibration { depth: camera, color: color_camera, .. } = choice.calibration;
    let sensor = Sensor {
        name: "camera".into(),
        identity,
        depth: camera,
        depth_scale: 0.001,
        color: color_camera.map(|(camera, _)| camera),
        color_from_depth: color_camera.map_or_else(Rigid::identity, |(_, pose)| pose),
        rig_from_depth: Rigid::identity(),
        fps: if period_ns > 0 { 1e9 / period_ns as f64 } else { fps(&shots) },
    };
    let album = MkvAlbum { file, depth: (choice.depth, depth), color: choice.color.map(|track| (track, color)) };
    let source = StoredSource::new(path.to_path_buf(), Rig { sensors: vec![sensor] }, shots, Box::new(album), remarks)?;
    Ok(source.missing(missing))
}

/// A number that a tag states; 0 where there is none.
fn whole(segment: &Segment, tag: &str) -> i64 {
    segment.tag(tag).and_then(|value| value.trim().parse().ok()).unwrap_or(0)
}

/// Frames of both tracks, by the time of depth; colour that is alone by its own.
fn paired(depth: &[Block], color: &[Block], offset_ns: i64, delay_ns: i64) -> Vec<Shot> {
    let times = |blocks: &[Block], shift: i64| -> Vec<i64> {
        blocks.iter().map(|block| block.time_ns.saturating_add(offset_ns).saturating_sub(shift)).collect()
    };
    let mut shots = shots(&times(depth, delay_ns), &times(color, 0));
    for shot in shots.iter_mut().filter(|shot| shot.depth.is_some()) {
        shot.time_ns = shot.time_ns.saturating_add(delay_ns);
    }
    shots.sort_by_key(|shot| shot.time_ns);
    shots
}

/// The tracks that are read, and their cameras.
struct Choice {
    depth: Track,
    color: Option<Track>,
    calibration: Calibration,
    remarks: Vec<String>,
}

/// # Errors
/// A sentence that says what is missing.
fn choose(segment: &Segment) -> Result<Choice, String> {
    // The recorder's tags hold ids of tracks; files that another program wrote anew may have lost them.
    let of = |name: &str| {
        let uid = segment.tag(&format!("K4A_{name}_TRACK")).and_then(|uid| uid.trim().parse::<u64>().ok());
        let video = || segment.tracks.iter().filter(|track| track.is_video);
        video().find(|track| Some(track.uid) == uid).or_else(|| video().find(|track| track.name == name))
    };
    let depth = of("DEPTH").ok_or_else(|| nothing(segment))?.clone();
    depth.check(&DEPTH_FORMATS)?;
    let mut remarks = Vec::new();
    let color = of("COLOR").and_then(|track| match track.check(&COLOR_FORMATS) {
        Ok(()) => Some(track.clone()),
        Err(reason) => {
            remarks.push(format!("its colour is left out: {reason}"));
            None
        }
    });
    let size = |track: &Track| (track.width, track.height);
    let attached = segment.tag("K4A_CALIBRATION_FILE").unwrap_or("calibration.json");
    let file = segment.files.iter().find(|(name, _)| name == attached);
    let (_, file) = file
        .ok_or("has no calibration.json attached, so where its pixels look is not known; record it with k4arecorder")?;
    let mut calibration = calibration::read(file, size(&depth), color.as_ref().map(size))?;
    remarks.append(&mut calibration.remarks);
    // Infrared and motion belong to every such recording and are of no use here: nothing is lost with them.
    let is_usual = |track: &Track| ["IR", "DEPTH_IR", "IMU"].contains(&track.name.as_str());
    let left_out = segment.tracks.iter().filter(|track| {
        !is_usual(track) && track.number != depth.number && color.as_ref().is_none_or(|c| c.number != track.number)
    });
    let left_out: Vec<String> = left_out.map(|track| printable(&track.name).into_owned()).collect();
    if !left_out.is_empty() {
        remarks.push(format!("tracks that are not read: {}", left_out.join(", ")));
    }
    Ok(Choice { depth, color, calibration, remarks })
}

fn nothing(segment: &Segment) -> String {
    if segment.tracks.is_empty() {
        return "is a Matroska file without tracks: it was cut off, or is damaged, at its start".into();
    }
    let mode = segment.tag("K4A_DEPTH_MODE").filter(|mode| *mode == "PASSIVE_IR");
    let reason = mode.map_or("", |_| " (it was recorded as PASSIVE_IR)");
    let tracks: Vec<String> =
        segment.tracks.iter().take(8).map(|t| printable(&format!("{} ({})", t.name, t.format)).into_owned()).collect();
    format!(
        "is a Matroska file without a depth track as k4arecorder writes it{reason}; its tracks: {}",
        tracks.join(", ")
    )
}

/// The pictures of a file.
#[derive(Debug)]
struct MkvAlbum {
    file: Ebml<File>,
    depth: (Track, Vec<Block>),
    color: Option<(Track, Vec<Block>)>,
}

impl MkvAlbum {
    fn bytes(&mut self, block: Block) -> Result<Vec<u8>, String> {
        let bytes = self.file.bytes(block.at, block.length).map_err(|error| format!("cannot be read: {error}"))?;
        if bytes.len() as u64 == block.length { Ok(bytes) } else { Err("is cut off".into()) }
    }
}

impl Album for MkvAlbum {
    fn depth(&mut self, k: usize) -> Result<DepthImage, String> {
        let bytes = self.bytes(self.depth.1[k])?;
        self.depth.0.depth(bytes)
    }

    fn color(&mut self, k: usize) -> Result<ColorImage, String> {
        let (_, blocks) = self.color.as_ref().ok_or("is of no track")?;
        let bytes = self.bytes(blocks[k])?;
        let (track, _) = self.color.as_ref().ok_or("is of no track")?;
        track.color(bytes)
    }
}

/// Reads a whole file, a calibration and a frame of each kind; for `fuzz/`.
pub(super) fn parse(bytes: &[u8]) {
    if let Ok(segment) = Ebml::new(std::io::Cursor::new(bytes)).and_then(|mut file| Segment::read(&mut file)) {
        let _ = choose(&segment);
    }
    let _ = calibration::read(bytes, (640, 576), Some((1280, 720)));
}

#[cfg(test)]
mod tests;
