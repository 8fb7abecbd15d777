//! `toile-folder`: depth/, color/, camera.json, timestamps.txt.

use std::{collections::BTreeMap, path::Path};

use super::{
    camera_file,
    inventory::{DEFAULT_FPS, FolderSource, Listing, last_number, pair, steady_time},
};
use crate::{CaptureError, trajectory::parse_seconds};

/// Metres a depth unit where the calibration does not say: millimetres.
const DEPTH_SCALE: f64 = 0.001;

pub(super) fn open(path: &Path, listing: &Listing) -> Result<FolderSource, CaptureError> {
    let depth_folder = path.join("depth");
    if !listing.folders.iter().any(|name| name == "depth") {
        return Err(CaptureError::format(path, "there is no folder depth/ with 16-bit PNG images in it"));
    }
    let depth = Listing::read(&depth_folder)?.numbered(&depth_folder, numbered(&["png"]))?;
    let color_name = ["color", "rgb"].into_iter().find(|name| listing.folders.iter().any(|folder| folder == name));
    let color = match color_name.map(|name| path.join(name)) {
        Some(folder) => Listing::read(&folder)?.numbered(&folder, numbered(&["jpg", "jpeg", "png"]))?,
        None => BTreeMap::new(),
    };
    let Some(camera_path) = camera_file::find(path)? else {
        return Err(CaptureError::format(
            &path.join("camera.json"),
            "is missing: it must say width, height, fx, fy, cx, cy and depth_scale",
        ));
    };
    let camera = camera_file::read(&camera_path)?;
    let fps = camera.fps.unwrap_or(DEFAULT_FPS);
    let rig = camera.rig("toile-folder", DEPTH_SCALE, fps, !color.is_empty());
    let times = read_times(path)?;
    let mut entries = pair(depth, color, BTreeMap::new(), |_, number| steady_time(number, fps));
    if let Some(times) = times {
        let numbers: Vec<u64> = entries.iter().map(|entry| entry.number).collect();
        let first = first_line(path, &numbers, times.len())?;
        for (position, entry) in entries.iter_mut().enumerate() {
            let line = first.map_or(position, |first| (entry.number - first) as usize);
            entry.time_ns = times[line];
        }
    }
    FolderSource::new(path, rig, entries, None)
}

fn numbered(extensions: &'static [&'static str]) -> impl Fn(&str) -> Option<u64> {
    move |name| {
        let extension = name.rsplit_once('.')?.1.to_ascii_lowercase();
        if extensions.contains(&extension.as_str()) { last_number(name) } else { None }
    }
}

/// Which frame number the first line of timestamps.txt belongs to; `None`: lines go by position.
fn first_line(path: &Path, numbers: &[u64], lines: usize) -> Result<Option<u64>, CaptureError> {
    let (Some(&low), Some(&high)) = (numbers.first(), numbers.last()) else { return Ok(None) };
    if lines == numbers.len() {
        return Ok(None);
    }
    for first in [0, low.min(1), low] {
        let span = high - first + 1;
        if span == lines as u64 {
            return Ok(Some(first));
        }
    }
    if high < lines as u64 {
        return Ok(Some(0));
    }
    Err(CaptureError::format(
        &path.join("timestamps.txt"),
        format!(
            "has {lines} lines, but there are {} frames, numbered {low} to {high}: it must have one time a frame",
            numbers.len()
        ),
    ))
}

/// The times, nanoseconds: whole numbers are nanoseconds, numbers with a decimal point seconds.
fn read_times(folder: &Path) -> Result<Option<Vec<i64>>, CaptureError> {
    let path = folder.join("timestamps.txt");
    if !path.exists() {
        return Ok(None);
    }
    let text = std::fs::read_to_string(&path).map_err(|error| CaptureError::io(&path, error))?;
    let mut times: Vec<i64> = Vec::new();
    for (number, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
        let word = line.trim();
        let time = if word.contains('.') { parse_seconds(word) } else { word.parse().ok() };
        let time = time.ok_or_else(|| {
            CaptureError::format(&path, format!("line {} is no time in nanoseconds: `{word}`", number + 1))
        })?;
        if times.last().is_some_and(|&before| before >= time) {
            return Err(CaptureError::format(&path, format!("line {} is not later than the one before", number + 1)));
        }
        times.push(time);
    }
    Ok(Some(times))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn timestamps_are_found_for_gaps_at_the_ends_and_inside() {
        let path = Path::new("x");
        assert_eq!(first_line(path, &[0, 1, 2], 3).unwrap(), None);
        assert_eq!(first_line(path, &[0, 2, 3], 4).unwrap(), Some(0), "a gap inside");
        assert_eq!(first_line(path, &[1, 2, 4], 4).unwrap(), Some(1), "numbered from 1, a gap inside");
        assert_eq!(first_line(path, &[2, 3], 4).unwrap(), Some(0), "the first two are missing");
        assert_eq!(first_line(path, &[0, 1], 4).unwrap(), Some(0), "the last two are missing");
        assert!(first_line(path, &[0, 1, 2], 2).is_err());
    }
}
