//! A folder's frames, listed by name and read one by one.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::Arc,
};

use super::images;
use crate::{CaptureError, Frame, Rig, Source};

/// Nominal rate where a folder does not say one (the common one of Kinect-class sensors).
pub(super) const DEFAULT_FPS: f64 = 30.0;

/// The largest frame number: a larger one is something else, and would only be rounded.
const MAX_NUMBER: u64 = 999_999_999_999;

/// A file with one of these extensions is an image, which must not be left out in silence.
const IMAGES: &[&str] = &["png", "jpg", "jpeg"];

/// The names in a folder, sorted; an image whose name is not UTF-8 is an error. Files that operating systems add (hidden ones such as `._000001.png` of a Mac, and
/// `Thumbs.db` or `desktop.ini`) are passed over.
#[derive(Debug, Default)]
pub(super) struct Listing {
    pub(super) files: Vec<String>,
    pub(super) folders: Vec<String>,
}

impl Listing {
    pub(super) fn read(path: &Path) -> Result<Self, CaptureError> {
        let mut listing = Self::default();
        for entry in std::fs::read_dir(path).map_err(|error| CaptureError::io(path, error))? {
            let entry = entry.map_err(|error| CaptureError::io(path, error))?;
            let name = match entry.file_name().into_string() {
                Ok(name) => name,
                Err(name) if has_extension(&name.to_string_lossy(), IMAGES) => {
                    return Err(CaptureError::format(&entry.path(), "its name is not valid UTF-8; rename it"));
                }
                Err(_) => continue,
            };
            if is_of_the_system(&name) {
                continue;
            }
            let list = if entry.path().is_dir() { &mut listing.folders } else { &mut listing.files };
            list.push(name);
        }
        listing.files.sort();
        listing.folders.sort();
        Ok(listing)
    }

    /// The files for whose name `number` gives a number, by that number.
    pub(super) fn numbered(
        &self,
        folder: &Path,
        number: impl Fn(&str) -> Option<u64>,
    ) -> Result<BTreeMap<u64, PathBuf>, CaptureError> {
        let mut files = BTreeMap::new();
        for name in &self.files {
            let Some(number) = number(name) else { continue };
            if number > MAX_NUMBER {
                let reason = "the number in its name has more than 12 digits: it is not a frame number";
                return Err(CaptureError::format(&folder.join(name), reason));
            }
            if let Some(other) = files.insert(number, folder.join(name)) {
                let reason = format!("has the same number as {}", other.display());
                return Err(CaptureError::format(&folder.join(name), reason));
            }
        }
        Ok(files)
    }
}

fn is_of_the_system(name: &str) -> bool {
    name.starts_with('.') || ["thumbs.db", "desktop.ini"].contains(&name.to_ascii_lowercase().as_str())
}

/// True where a file's name ends in one of these extensions.
pub(super) fn has_extension(name: &str, extensions: &[&str]) -> bool {
    name.rsplit_once('.').is_some_and(|(_, extension)| extensions.contains(&extension.to_ascii_lowercase().as_str()))
}

/// The last run of digits in a file's stem: its frame number. One beyond 64 bits gives [`u64::MAX`], which
/// [`Listing::numbered`] refuses.
pub(super) fn last_number(name: &str) -> Option<u64> {
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    let digits = |c: char| c.is_ascii_digit();
    let ending = &stem[..=stem.rfind(digits)?];
    Some(ending[ending.trim_end_matches(digits).len()..].parse().unwrap_or(u64::MAX))
}

/// Where one frame's images are.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Entry {
    pub(super) number: u64,
    pub(super) time_ns: i64,
    pub(super) depth: Option<PathBuf>,
    pub(super) color: Option<PathBuf>,
    pub(super) mask: Option<PathBuf>,
    /// Why the frame cannot be used although its images are there.
    pub(super) refused: Option<Refused>,
}

/// The file that makes a frame useless, and what is wrong in it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Refused {
    pub(super) file: PathBuf,
    pub(super) reason: String,
}

/// Pairs depth with colour by number. `time_ns` gives the time of a number.
pub(super) fn pair(
    mut depth: BTreeMap<u64, PathBuf>,
    mut color: BTreeMap<u64, PathBuf>,
    mut mask: BTreeMap<u64, PathBuf>,
    time_ns: impl Fn(usize, u64) -> i64,
) -> Vec<Entry> {
    let mut numbers: Vec<u64> = depth.keys().chain(color.keys()).copied().collect();
    numbers.sort_unstable();
    numbers.dedup();
    let entry = |(position, number): (usize, u64)| Entry {
        number,
        time_ns: time_ns(position, number),
        depth: depth.remove(&number),
        color: color.remove(&number),
        mask: mask.remove(&number),
        refused: None,
    };
    numbers.into_iter().enumerate().map(entry).collect()
}

/// The rate that the frames' own times show: one divided by the median step; `None` where they do not rise.
pub(super) fn measured_fps(entries: &[Entry]) -> Option<f64> {
    let step = |pair: &[Entry]| pair[1].time_ns.saturating_sub(pair[0].time_ns);
    let mut steps: Vec<i64> = entries.windows(2).map(step).collect();
    steps.sort_unstable();
    steps.get(steps.len() / 2).filter(|step| **step > 0).map(|step| 1e9 / *step as f64)
}

/// Time of frame `number` at a steady rate from 0.
pub(super) fn steady_time(number: u64, fps: f64) -> i64 {
    (number as f64 * 1e9 / fps).round() as i64
}

/// A folder of images as a source; one sensor.
#[derive(Debug)]
pub(super) struct FolderSource {
    rig: Rig,
    entries: Vec<Entry>,
    /// Numbers count by this much (7-Scenes excerpts keep every second frame).
    stride: u64,
    /// A depth value that means "nothing was measured", besides 0.
    missing_value: Option<u16>,
    next: usize,
    /// What is known to be missing, a sentence each.
    pub(super) remarks: Vec<String>,
}

impl FolderSource {
    /// A source over `entries`, whose numbers must rise.
    pub(super) fn new(
        path: &Path,
        mut rig: Rig,
        entries: Vec<Entry>,
        missing_value: Option<u16>,
    ) -> Result<Self, CaptureError> {
        if !entries.iter().any(|entry| entry.depth.is_some()) {
            return Err(CaptureError::format(path, "there is no depth image in this folder"));
        }
        let stride = entries.windows(2).fold(0, |all, pair| gcd(all, pair[1].number.saturating_sub(pair[0].number)));
        let stride = stride.max(1);
        rig.sensors.iter_mut().for_each(|sensor| sensor.fps /= stride as f64);
        Ok(Self { rig, entries, stride, missing_value, next: 0, remarks: Vec::new() })
    }

    pub(super) fn entries(&self) -> &[Entry] {
        &self.entries
    }

    fn load(&self, index: usize) -> Result<Frame, CaptureError> {
        let entry = &self.entries[index];
        if let Some(refused) = &entry.refused {
            return Err(CaptureError::format(&refused.file, &refused.reason));
        }
        let sensor = &self.rig.sensors[0];
        let depth = match &entry.depth {
            Some(path) => {
                let mut depth = images::read_depth(path, &sensor.depth)?;
                if let Some(missing) = self.missing_value {
                    depth.values.iter_mut().filter(|value| **value == missing).for_each(|value| *value = 0);
                }
                if let Some(mask) = &entry.mask {
                    images::apply_mask(mask, &mut depth)?;
                }
                Some(Arc::new(depth))
            }
            None => None,
        };
        let color = match (&entry.color, &sensor.color) {
            (Some(path), Some(camera)) => Some(images::read_color(path, camera)?),
            _ => None,
        };
        Ok(Frame {
            sensor: 0,
            index: index as u64,
            device_frame: entry.number,
            lost_before: self.lost_before(index),
            device_time_ns: entry.time_ns,
            host_time_ns: entry.time_ns,
            depth,
            color,
        })
    }

    fn lost_before(&self, index: usize) -> u32 {
        let Some(before) = index.checked_sub(1) else { return 0 };
        let step = self.entries[index].number.saturating_sub(self.entries[before].number) / self.stride;
        u32::try_from(step.saturating_sub(1)).unwrap_or(u32::MAX)
    }
}

impl Source for FolderSource {
    fn rig(&self) -> &Rig {
        &self.rig
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, CaptureError> {
        if self.next >= self.entries.len() {
            return Ok(None);
        }
        self.next += 1;
        self.load(self.next - 1).map(Some)
    }

    fn frame_count(&self) -> Option<u64> {
        Some(self.entries.len() as u64)
    }

    fn remarks(&self) -> Vec<String> {
        self.remarks.clone()
    }
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_from_the_last_digits_of_the_stem() {
        assert_eq!(last_number("000012.png"), Some(12));
        assert_eq!(last_number("cam2_depth_0031.png"), Some(31));
        assert_eq!(last_number("7x.png"), Some(7));
        assert_eq!(last_number("depth.png"), None);
        assert_eq!(last_number("99999999999999999999999.png"), Some(u64::MAX));
        assert_eq!(last_number("M\u{fc}0031.png"), Some(31), "the digits may follow any character");
        assert_eq!(last_number("7\u{8eab}.png"), Some(7));
        assert_eq!(last_number("depth.mp4"), None, "the extension's digits are not a frame number");
    }
}
