//! `associations.txt`: folders of ICL-NUIM, and of TUM RGB-D after its tool has paired the images: each line `t file t file`,
//! depth and colour in either order; 5000 units a metre, as in TUM RGB-D.

use std::path::Path;

use toile_geometry::camera::PinholeCamera;

use super::{
    camera_file::{self, CameraFile},
    images,
    inventory::{DEFAULT_FPS, Entry, FolderSource, Listing, measured_fps, steady_time},
    timed::check_time,
};
use crate::{CaptureError, files::read_text, printable, trajectory::parse_seconds};

const DEPTH_SCALE: f64 = 1.0 / 5000.0;
/// Names of the list.
const NAMES: [&str; 4] = ["associations.txt", "association.txt", "associate.txt", "associated.txt"];

/// The list in a folder.
pub(super) fn list_in(listing: &Listing) -> Option<&'static str> {
    NAMES.into_iter().find(|name| listing.files.iter().any(|file| file == name))
}

pub(super) fn open(path: &Path, listing: &Listing) -> Result<FolderSource, CaptureError> {
    let missing = || CaptureError::format(&path.join(NAMES[0]), "is missing: it lists depth and colour of each frame");
    let list = path.join(list_in(listing).ok_or_else(missing)?);
    let text = read_text(&list)?;
    let lines = text.lines().enumerate().map(|(n, line)| (n + 1, line.split('#').next().unwrap_or("").trim()));
    let mut entries = Vec::new();
    for (number, line) in lines.filter(|(_, line)| !line.is_empty()) {
        let wrong = |reason: String| CaptureError::format(&list, format!("line {number}: {reason}"));
        let entry = entry(path, line).ok_or_else(|| wrong(format!("is not `t file t file`: `{}`", printable(line))))?;
        check_time(entry.time_ns).map_err(wrong)?;
        entries.push(entry);
    }
    entries.sort_by_key(|entry| entry.time_ns);
    // ICL-NUIM counts frames where TUM has seconds.
    let is_counted = entries.iter().all(|entry| entry.time_ns % 1_000_000_000 == 0);
    for (k, entry) in entries.iter_mut().enumerate() {
        entry.number = k as u64;
        if is_counted {
            entry.time_ns = steady_time(u64::try_from(entry.time_ns / 1_000_000_000).unwrap_or(0), DEFAULT_FPS);
        }
    }
    let camera = match camera_file::find(path)? {
        Some(file) => camera_file::read(&file)?,
        None => usual(path, &entries, is_counted)?,
    };
    let fps = camera.fps.or_else(|| measured_fps(&entries)).unwrap_or(DEFAULT_FPS);
    let mut source = FolderSource::new(path, camera.rig("associated", DEPTH_SCALE, fps, true), entries, None)?;
    if is_counted {
        source.remarks.push(format!(
            "the list counts frames instead of telling times; {DEFAULT_FPS} frames a second are assumed"
        ));
    }
    Ok(source)
}

fn entry(folder: &Path, line: &str) -> Option<Entry> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let [first_time, first, second_time, second] = words.as_slice() else { return None };
    let is_depth = |name: &str| name.to_ascii_lowercase().contains("depth");
    let (time, depth, color) = if is_depth(first) { (first_time, first, second) } else { (second_time, second, first) };
    let at = |name: &str| Some(folder.join(name));
    let time_ns = parse_seconds(time)?;
    is_depth(depth).then(|| Entry { number: 0, time_ns, depth: at(depth), color: at(color), mask: None, refused: None })
}

/// The intrinsics that the data sets recommend for 640 × 480: of ICL-NUIM's virtual camera (whose images have their rows from
/// above, so that its negative focal length is positive here), or of TUM's.
fn usual(path: &Path, entries: &[Entry], is_counted: bool) -> Result<CameraFile, CaptureError> {
    let first = entries.iter().find_map(|entry| entry.depth.as_deref());
    let size = images::file_size(first.ok_or_else(|| CaptureError::format(path, "the list names no depth image"))?)?;
    if size != (640, 480) {
        let reason =
            format!("is missing: the usual calibration is for 640 x 480, the images have {} x {}", size.0, size.1);
        return Err(CaptureError::format(&path.join("camera.json"), reason));
    }
    let (fx, fy) = if is_counted { (481.2, 480.0) } else { (525.0, 525.0) };
    Ok(CameraFile { is_assumed: true, ..CameraFile::ideal(PinholeCamera::ideal(640, 480, fx, fy, 319.5, 239.5)) })
}
