//! `tum`: the TUM RGB-D benchmark's folders (Sturm et al. 2012): depth.txt and rgb.txt list `time file`; depth and colour
//! are registered and pair by time. Also a folder of pairs such as `X_depth.png` and `X_color.png`.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use toile_geometry::camera::PinholeCamera;

use super::{
    camera_file::{self, CameraFile},
    images,
    inventory::{
        DEFAULT_FPS, Entry, FolderSource, Listing, has_extension, last_number, measured_fps, pair, steady_time,
    },
    timed::{Timed, check_time, pair_by_time},
};
use crate::{CaptureError, files::read_text, printable, trajectory::parse_seconds};

/// Numbers in names from here on are something else, such as dates or times, and only give the order.
const MAX_COUNT: u64 = 10_000_000;
/// Metres a depth unit.
const DEPTH_SCALE: f64 = 1.0 / 5000.0;

pub(super) fn open(path: &Path, listing: &Listing) -> Result<FolderSource, CaptureError> {
    let entries = if listing.files.iter().any(|name| name == "depth.txt") {
        let depth = read_list(path, "depth.txt")?;
        let has_color = listing.files.iter().any(|name| name == "rgb.txt");
        let color = if has_color { read_list(path, "rgb.txt")? } else { Vec::new() };
        pair_by_time(depth, color)
    } else {
        named_pairs(path, listing)?
    };
    let camera = match camera_file::find(path)? {
        Some(file) => camera_file::read(&file)?,
        None => default_camera(path, &entries)?,
    };
    let has_color = entries.iter().any(|entry| entry.color.is_some());
    let fps = camera.fps.or_else(|| measured_fps(&entries)).unwrap_or(DEFAULT_FPS);
    let rig = camera.rig("tum", DEPTH_SCALE, fps, has_color);
    FolderSource::new(path, rig, entries, None)
}

/// True for names such as `TUM_depth.png`.
pub(super) fn is_paired_depth(name: &str) -> bool {
    let name = name.to_ascii_lowercase();
    has_extension(&name, &["png"]) && name.contains("depth")
}

fn read_list(folder: &Path, name: &str) -> Result<Vec<Timed>, CaptureError> {
    let path = folder.join(name);
    let text = read_text(&path)?;
    let mut list = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or("").trim();
        if line.is_empty() {
            continue;
        }
        let timed = line
            .split_once(char::is_whitespace)
            .and_then(|(time, file)| Some(Timed { time_ns: parse_seconds(time)?, path: folder.join(file.trim()) }));
        let timed = timed.ok_or_else(|| {
            CaptureError::format(&path, format!("line {} is not `time file`: `{}`", number + 1, printable(line)))
        })?;
        check_time(timed.time_ns)
            .map_err(|reason| CaptureError::format(&path, format!("line {}: {reason}", number + 1)))?;
        list.push(timed);
    }
    Ok(list)
}

/// Pairs by name: `X_depth.png` belongs to `X_color.*` or `X_rgb.*`. Where every name has a number of its own, frames are
/// in the order of these numbers and carry them; otherwise in the order of their names, in which numbers count as numbers.
fn named_pairs(folder: &Path, listing: &Listing) -> Result<Vec<Entry>, CaptureError> {
    let collect = |words: &[&str]| -> BTreeMap<String, PathBuf> {
        let keyed = |name: &String| words.iter().find_map(|word| Some((key(name, word)?, folder.join(name))));
        listing.files.iter().filter_map(keyed).collect()
    };
    let (depth, color) = (collect(&["depth"]), collect(&["color", "rgb"]));
    if depth.is_empty() {
        return Err(CaptureError::format(&folder.join("depth.txt"), "is missing: it lists the depth images' times"));
    }
    let numbers = frame_numbers(depth.keys().chain(color.keys()));
    let by_number = |files: BTreeMap<String, PathBuf>| -> BTreeMap<u64, PathBuf> {
        files.into_iter().map(|(key, path)| (numbers[&key], path)).collect()
    };
    Ok(pair(by_number(depth), by_number(color), BTreeMap::new(), |_, number| steady_time(number, DEFAULT_FPS)))
}

/// An image's name without its extension and without `word`, which must be in it.
fn key(name: &str, word: &str) -> Option<String> {
    let name = name.to_ascii_lowercase();
    let (stem, _) = name.rsplit_once('.').filter(|_| has_extension(&name, &["png", "jpg", "jpeg"]))?;
    stem.contains(word).then(|| stem.replace(word, ""))
}

/// A frame number for each key.
fn frame_numbers<'a>(keys: impl Iterator<Item = &'a String>) -> BTreeMap<String, u64> {
    let mut keys: Vec<&String> = keys.collect();
    keys.sort_by_cached_key(|key| natural(key));
    keys.dedup();
    let own: Option<BTreeMap<u64, &String>> =
        keys.iter().map(|key| Some((last_number(key).filter(|n| *n < MAX_COUNT)?, *key))).collect();
    match own.filter(|own| own.len() == keys.len()) {
        Some(own) => own.into_iter().map(|(number, key)| (key.clone(), number)).collect(),
        None => keys.into_iter().cloned().zip(0..).collect(),
    }
}

/// A key that sorts names as people do: runs of digits by their value. The name itself decides between equals.
pub(super) fn natural(name: &str) -> (Vec<(String, usize, String)>, String) {
    let mut parts = Vec::new();
    let mut rest = name;
    while !rest.is_empty() {
        let (text, behind) = rest.split_at(rest.find(|c: char| c.is_ascii_digit()).unwrap_or(rest.len()));
        let (digits, behind) = behind.split_at(behind.find(|c: char| !c.is_ascii_digit()).unwrap_or(behind.len()));
        let value = digits.trim_start_matches('0');
        parts.push((text.to_string(), value.len(), value.to_string()));
        rest = behind;
    }
    (parts, name.to_string())
}

/// The benchmark's recommended intrinsics for 640×480, where a folder brings none.
fn default_camera(folder: &Path, entries: &[Entry]) -> Result<CameraFile, CaptureError> {
    let first = entries.iter().find_map(|entry| entry.depth.as_deref());
    let first = first.ok_or_else(|| CaptureError::format(folder, "there is no depth image in this folder"))?;
    match images::file_size(first)? {
        (640, 480) => {
            let usual = CameraFile::ideal(PinholeCamera::ideal(640, 480, 525.0, 525.0, 319.5, 239.5));
            Ok(CameraFile { is_assumed: true, ..usual })
        }
        (width, height) => Err(CaptureError::format(
            &folder.join("camera.json"),
            format!("is missing: the default calibration is for 640 x 480, the images have {width} x {height}"),
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_calibration_that_nobody_gave_is_said_to_be_assumed() {
        let usual = CameraFile {
            is_assumed: true,
            ..CameraFile::ideal(PinholeCamera::ideal(640, 480, 525.0, 525.0, 319.5, 239.5))
        };
        let sentences = [true, false].map(|is_assumed| {
            let camera = CameraFile { is_assumed, ..usual.clone() };
            camera.rig("tum", 0.0002, 30.0, false).sensors[0].assumption()
        });
        assert!(
            sentences[0].as_ref().is_some_and(|s| s.contains("525 pixels") && s.contains("camera.json")),
            "{sentences:?}"
        );
        assert_eq!(sentences[1], None);
    }

    fn numbers(keys: &[&str]) -> Vec<(String, u64)> {
        let keys: Vec<String> = keys.iter().map(ToString::to_string).collect();
        let mut numbers: Vec<_> = frame_numbers(keys.iter()).into_iter().collect();
        numbers.sort_by_key(|(_, number)| *number);
        numbers
    }

    #[test]
    fn names_without_padding_are_in_the_order_of_their_numbers() {
        let order = |keys: &[&str]| numbers(keys).into_iter().map(|(key, _)| key).collect::<Vec<_>>();
        assert_eq!(order(&["_10", "_2", "_1", "_0"]), ["_0", "_1", "_2", "_10"]);
        assert_eq!(order(&["b", "a10", "a9", "a"]), ["a", "a9", "a10", "b"]);
        assert_eq!(order(&["x2_7", "x10_7", "x1_7"]), ["x1_7", "x2_7", "x10_7"], "the last number is not their own");
        assert_eq!(numbers(&["_7", "_10"]), [("_7".to_string(), 7), ("_10".to_string(), 10)]);
    }
}
