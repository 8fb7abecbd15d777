//! `toile-folder`: depth/, color/, camera.json, timestamps.txt.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use super::{
    camera_file::{self, CameraFile},
    inventory::{
        DEFAULT_FPS, Entry, FolderSource, Listing, Refused, has_extension, last_number, measured_fps, pair, steady_time,
    },
    number_list::number_list,
    timed::{Timed, check_time, named_by_time, pair_by_time},
};
use crate::{
    CaptureError,
    files::{is_there, read_text},
    printable, printable_path,
    trajectory::parse_seconds,
};

/// Metres a depth unit where the calibration does not say: millimetres.
const DEPTH_SCALE: f64 = 0.001;

pub(super) fn open(path: &Path, listing: &Listing) -> Result<FolderSource, CaptureError> {
    if !listing.folders.iter().any(|name| name == "depth") {
        return Err(CaptureError::format(path, "there is no folder depth/ with 16-bit PNG images in it"));
    }
    let Some(camera_path) = camera_file::find(path)? else {
        return Err(CaptureError::format(
            &path.join("camera.json"),
            "is missing: it must say width, height, fx, fy, cx, cy and depth_scale",
        ));
    };
    let camera = camera_file::read(&camera_path)?;
    let color_name = ["color", "rgb"].into_iter().find(|name| listing.folders.iter().any(|folder| folder == name));
    let depth = Images::list(&path.join("depth"), DEPTH_EXTENSIONS)?;
    let color = color_name.map(|name| Images::list(&path.join(name), COLOR_EXTENSIONS)).transpose()?;
    let is_timed = matches!(depth, Images::Timed(_));
    let mut entries = match (depth, color) {
        (Images::Timed(depth), None) => pair_by_time(depth, Vec::new()),
        (Images::Timed(depth), Some(Images::Timed(color))) => pair_by_time(depth, color),
        (Images::Numbered(depth), None) => numbered_pairs(depth, BTreeMap::new(), &camera),
        (Images::Numbered(depth), Some(Images::Numbered(color))) => numbered_pairs(depth, color, &camera),
        _ => {
            let reason = "depth and colour are named differently: one by times, the other by numbers; name both alike";
            return Err(CaptureError::format(path, reason));
        }
    };
    // Numbers may leave some out, so only names that are times show the rate.
    let rate = if is_timed { measured_fps(&entries) } else { None };
    let mut remarks = Vec::new();
    if let Some(stamps) = read_times(path)? {
        remarks.extend(set_times(path, &mut entries, &stamps)?);
    }
    let has_color = entries.iter().any(|entry| entry.color.is_some());
    let fps = camera.fps.or(rate).unwrap_or(DEFAULT_FPS);
    let mut source = FolderSource::new(path, camera.rig("toile-folder", DEPTH_SCALE, fps, has_color), entries, None)?;
    source.remarks = remarks;
    Ok(source)
}

const DEPTH_EXTENSIONS: &[&str] = &["png"];
const COLOR_EXTENSIONS: &[&str] = &["jpg", "jpeg", "png"];

/// The images of one folder.
enum Images {
    Numbered(BTreeMap<u64, PathBuf>),
    Timed(Vec<Timed>),
}

impl Images {
    fn list(folder: &Path, extensions: &[&str]) -> Result<Self, CaptureError> {
        let listing = Listing::read(folder)?;
        if let Some(timed) = named_by_time(folder, &listing, extensions)? {
            return Ok(Self::Timed(timed));
        }
        let number = |name: &str| last_number(name).filter(|_| has_extension(name, extensions));
        listing.numbered(folder, number).map(Self::Numbered)
    }
}

fn numbered_pairs(depth: BTreeMap<u64, PathBuf>, color: BTreeMap<u64, PathBuf>, camera: &CameraFile) -> Vec<Entry> {
    let fps = camera.fps.unwrap_or(DEFAULT_FPS);
    pair(depth, color, BTreeMap::new(), |_, number| steady_time(number, fps))
}

/// A line of timestamps.txt that has a time.
struct Stamp {
    /// Number of the line, from 1.
    line: usize,
    time_ns: i64,
}

/// Gives frames the times of timestamps.txt. Of two frames with the same time the first is kept and the second refused:
/// which of them was taken then is not known. Says which frames have a time, but lie outside of those that are there.
fn set_times(path: &Path, entries: &mut [Entry], stamps: &[Stamp]) -> Result<Option<String>, CaptureError> {
    let numbers: Vec<u64> = entries.iter().map(|entry| entry.number).collect();
    let first = first_line(path, &numbers, stamps.len())?;
    let (mut before, mut repeated) = (None, 0);
    for (position, entry) in entries.iter_mut().enumerate() {
        let stamp = &stamps[first.map_or(position, |first| (entry.number - first) as usize)];
        entry.time_ns = stamp.time_ns;
        if before == Some(stamp.time_ns) {
            repeated += 1;
            let reason = format!(
                "line {} has the same time as the frame before; frame {} is left out",
                stamp.line, entry.number
            );
            entry.refused = Some(Refused { file: path.join("timestamps.txt"), reason });
        }
        before = Some(stamp.time_ns);
    }
    if 2 * repeated > entries.len() {
        let reason = format!("{repeated} of {} frames have the same time as the one before", entries.len());
        return Err(CaptureError::format(&path.join("timestamps.txt"), reason));
    }
    Ok(first.and_then(|first| missing_ends(path, &numbers, first, stamps.len() as u64)))
}

/// Which frames timestamps.txt has a time for before the first and behind the last image; `None` where there are none.
fn missing_ends(path: &Path, numbers: &[u64], first: u64, lines: u64) -> Option<String> {
    let (low, high) = (*numbers.first()?, *numbers.last()?);
    let missing: Vec<u64> = (first..low).chain(high + 1..first + lines).collect();
    let file = printable_path(&path.join("timestamps.txt"));
    let (count, list) = (missing.len(), number_list(&missing));
    (count > 0).then(|| format!("{file}: of {count} frames there is a time, but no image: {list}"))
}

/// Which frame number the first line of timestamps.txt belongs to; `None`: lines go by position.
fn first_line(path: &Path, numbers: &[u64], lines: usize) -> Result<Option<u64>, CaptureError> {
    let (Some(&low), Some(&high)) = (numbers.first(), numbers.last()) else { return Ok(None) };
    if lines == numbers.len() {
        return Ok(None);
    }
    for first in [0, low.min(1), low] {
        if high.checked_sub(first).and_then(|last| last.checked_add(1)) == Some(lines as u64) {
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

/// The times, which do not fall: whole numbers are nanoseconds, numbers with a decimal point seconds.
fn read_times(folder: &Path) -> Result<Option<Vec<Stamp>>, CaptureError> {
    let path = folder.join("timestamps.txt");
    if !is_there(&path) {
        return Ok(None);
    }
    let text = read_text(&path)?;
    let mut stamps: Vec<Stamp> = Vec::new();
    for (number, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
        let word = line.trim();
        let time = if word.contains('.') { parse_seconds(word) } else { word.parse().ok() };
        let time_ns = time.ok_or_else(|| {
            CaptureError::format(
                &path,
                format!("line {} is not a time in nanoseconds: `{}`", number + 1, printable(word)),
            )
        })?;
        check_time(time_ns).map_err(|reason| CaptureError::format(&path, format!("line {}: {reason}", number + 1)))?;
        if stamps.last().is_some_and(|before| before.time_ns > time_ns) {
            return Err(CaptureError::format(&path, format!("line {} is earlier than the one before", number + 1)));
        }
        stamps.push(Stamp { line: number + 1, time_ns });
    }
    Ok(Some(stamps))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_without_an_image_at_either_end_are_said() {
        let said = |numbers: &[u64], first, lines| missing_ends(Path::new("x"), numbers, first, lines);
        assert_eq!((said(&[0, 2, 3], 0, 4), said(&[2, 3], 2, 2)), (None, None));
        let both = said(&[2, 3], 0, 6).unwrap();
        assert!(
            both.starts_with("x/timestamps.txt: ") && both.contains("of 4 frames") && both.ends_with("0-1, 4-5"),
            "{both}"
        );
    }

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
