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
    inventory::{DEFAULT_FPS, Entry, FolderSource, Listing, pair, steady_time},
};
use crate::{CaptureError, trajectory::parse_seconds};

/// Metres a depth unit.
const DEPTH_SCALE: f64 = 1.0 / 5000.0;
/// Depth and colour further apart than this do not belong together (the benchmark's own default).
const MAX_APART_NS: i64 = 20_000_000;

struct Timed {
    time_ns: i64,
    path: PathBuf,
}

pub(super) fn open(path: &Path, listing: &Listing) -> Result<FolderSource, CaptureError> {
    let entries = if listing.files.iter().any(|name| name == "depth.txt") {
        let depth = read_list(path, "depth.txt")?;
        let has_color = listing.files.iter().any(|name| name == "rgb.txt");
        let color = if has_color { read_list(path, "rgb.txt")? } else { Vec::new() };
        associate(depth, color)
    } else {
        named_pairs(path, listing)?
    };
    let camera = match camera_file::find(path)? {
        Some(file) => camera_file::read(&file)?,
        None => default_camera(path, &entries)?,
    };
    let has_color = entries.iter().any(|entry| entry.color.is_some());
    let rig = camera.rig("tum", DEPTH_SCALE, camera.fps.unwrap_or(DEFAULT_FPS), has_color);
    FolderSource::new(path, rig, entries, None)
}

/// True for names such as `TUM_depth.png`.
pub(super) fn is_paired_depth(name: &str) -> bool {
    let name = name.to_ascii_lowercase();
    name.ends_with(".png") && name.contains("depth")
}

/// Pairs each depth image with the colour image nearest in time, closest pairs first, each used once.
fn associate(depth: Vec<Timed>, color: Vec<Timed>) -> Vec<Entry> {
    let mut pairs = Vec::new();
    for (i, d) in depth.iter().enumerate() {
        let near = color.partition_point(|c| c.time_ns < d.time_ns.saturating_sub(MAX_APART_NS));
        for (j, c) in color.iter().enumerate().skip(near) {
            let apart = c.time_ns.saturating_sub(d.time_ns).saturating_abs();
            if apart > MAX_APART_NS {
                break;
            }
            pairs.push((apart, i, j));
        }
    }
    pairs.sort_unstable();
    let mut partner = vec![None; depth.len()];
    let mut taken = vec![false; color.len()];
    for (_, i, j) in pairs {
        if partner[i].is_none() && !taken[j] {
            partner[i] = Some(j);
            taken[j] = true;
        }
    }
    let paired = depth.into_iter().zip(partner).map(|(d, j)| entry(d.time_ns, Some(d.path), j.map(|j| &color[j])));
    let alone = color.iter().zip(&taken).filter(|(_, taken)| !**taken).map(|(c, _)| entry(c.time_ns, None, Some(c)));
    let mut entries: Vec<Entry> = paired.chain(alone).collect();
    entries.sort_by_key(|entry| entry.time_ns);
    entries.iter_mut().enumerate().for_each(|(number, entry)| entry.number = number as u64);
    entries
}

fn entry(time_ns: i64, depth: Option<PathBuf>, color: Option<&Timed>) -> Entry {
    Entry { number: 0, time_ns, depth, color: color.map(|c| c.path.clone()), mask: None }
}

fn read_list(folder: &Path, name: &str) -> Result<Vec<Timed>, CaptureError> {
    let path = folder.join(name);
    let text = std::fs::read_to_string(&path).map_err(|error| CaptureError::io(&path, error))?;
    let mut list = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or("").trim();
        if line.is_empty() {
            continue;
        }
        let timed = line
            .split_once(char::is_whitespace)
            .and_then(|(time, file)| Some(Timed { time_ns: parse_seconds(time)?, path: folder.join(file.trim()) }));
        list.push(
            timed.ok_or_else(|| {
                CaptureError::format(&path, format!("line {} is not `time file`: `{line}`", number + 1))
            })?,
        );
    }
    list.sort_by_key(|timed| timed.time_ns);
    Ok(list)
}

/// Pairs by name: `X_depth.png` belongs to `X_color.*` or `X_rgb.*`.
fn named_pairs(folder: &Path, listing: &Listing) -> Result<Vec<Entry>, CaptureError> {
    let key = |name: &str, word: &str| {
        let name = name.to_ascii_lowercase();
        let (stem, extension) = name.rsplit_once('.')?;
        let image = matches!(extension, "png" | "jpg" | "jpeg");
        (image && stem.contains(word)).then(|| stem.replace(word, ""))
    };
    let collect = |words: &[&str]| -> BTreeMap<String, PathBuf> {
        let keyed = |name: &String| words.iter().find_map(|word| Some((key(name, word)?, folder.join(name))));
        listing.files.iter().filter_map(keyed).collect()
    };
    let (depth, color) = (collect(&["depth"]), collect(&["color", "rgb"]));
    if depth.is_empty() {
        return Err(CaptureError::format(&folder.join("depth.txt"), "is missing: it lists the depth images' times"));
    }
    let numbers: BTreeMap<&String, u64> =
        depth.keys().chain(color.keys()).collect::<std::collections::BTreeSet<_>>().into_iter().zip(0..).collect();
    let by_number = |files: &BTreeMap<String, PathBuf>| {
        files.iter().map(|(key, path)| (numbers[key], path.clone())).collect::<BTreeMap<u64, PathBuf>>()
    };
    Ok(pair(by_number(&depth), by_number(&color), BTreeMap::new(), |_, number| steady_time(number, DEFAULT_FPS)))
}

/// The benchmark's recommended intrinsics for 640×480, where a folder brings none.
fn default_camera(folder: &Path, entries: &[Entry]) -> Result<CameraFile, CaptureError> {
    let first = entries.iter().find_map(|entry| entry.depth.as_deref());
    let first = first.ok_or_else(|| CaptureError::format(folder, "there is no depth image in this folder"))?;
    match images::file_size(first)? {
        (640, 480) => Ok(CameraFile::ideal(PinholeCamera::ideal(640, 480, 525.0, 525.0, 319.5, 239.5))),
        (width, height) => Err(CaptureError::format(
            &folder.join("camera.json"),
            format!("is missing: the default calibration is for 640 x 480, the images have {width} x {height}"),
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn timed(milliseconds: &[i64]) -> Vec<Timed> {
        let one = |&ms: &i64| Timed { time_ns: ms * 1_000_000, path: PathBuf::from(format!("{ms}")) };
        milliseconds.iter().map(one).collect()
    }

    #[test]
    fn associates_each_image_once_with_the_nearest() {
        let entries = associate(timed(&[0, 30, 60, 200]), timed(&[5, 33, 38, 61, 400]));
        let names: Vec<_> = entries
            .iter()
            .map(|e| {
                let name = |p: &Option<PathBuf>| p.as_ref().map_or("-".into(), |p| p.display().to_string());
                format!("{}/{}", name(&e.depth), name(&e.color))
            })
            .collect();
        assert_eq!(names, ["0/5", "30/33", "-/38", "60/61", "200/-", "-/400"]);
        assert!(entries.iter().enumerate().all(|(i, e)| e.number == i as u64));
    }
}
