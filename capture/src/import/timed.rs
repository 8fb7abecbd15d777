//! Images that have times: in a list, or in their names.

use std::path::{Path, PathBuf};

use super::inventory::{Entry, Listing, has_extension};
use crate::{CaptureError, associate::associate, trajectory::parse_seconds};

/// Depth and colour further apart than this do not belong together (the TUM benchmark's own default).
const MAX_APART_NS: i64 = 20_000_000;

/// An image at a time.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Timed {
    pub(super) time_ns: i64,
    pub(super) path: PathBuf,
}

/// Refuses a time that a recording cannot hold.
pub(super) fn check_time(time_ns: i64) -> Result<(), String> {
    if time_ns >= 0 {
        return Ok(());
    }
    Err(format!("the time {time_ns} ns is before 0, and a recording holds no such time; count from an earlier moment"))
}

/// Pairs each depth image with the colour image nearest in time, closest pairs first, each used once. Frames are in the
/// order of their times and are numbered by it.
pub(super) fn pair_by_time(mut depth: Vec<Timed>, mut color: Vec<Timed>) -> Vec<Entry> {
    depth.sort_by_key(|timed| timed.time_ns);
    color.sort_by_key(|timed| timed.time_ns);
    let times = |list: &[Timed]| list.iter().map(|timed| timed.time_ns).collect::<Vec<i64>>();
    let partner = associate(&times(&depth), &times(&color), MAX_APART_NS);
    let mut is_paired = vec![false; color.len()];
    partner.iter().flatten().for_each(|&j| is_paired[j] = true);
    let paired = depth.into_iter().zip(partner).map(|(d, j)| entry(d.time_ns, Some(d.path), j.map(|j| &color[j])));
    let alone =
        color.iter().zip(&is_paired).filter(|(_, paired)| !**paired).map(|(c, _)| entry(c.time_ns, None, Some(c)));
    let mut entries: Vec<Entry> = paired.chain(alone).collect();
    entries.sort_by_key(|entry| entry.time_ns);
    entries.iter_mut().enumerate().for_each(|(number, entry)| entry.number = number as u64);
    entries
}

fn entry(time_ns: i64, depth: Option<PathBuf>, color: Option<&Timed>) -> Entry {
    Entry { number: 0, time_ns, depth, color: color.map(|c| c.path.clone()), mask: None, refused: None }
}

/// The images of a folder with one of these extensions, where all of their names are times; `None` where none is.
///
/// # Errors
/// [`CaptureError`] where some names are times and others are not.
pub(super) fn named_by_time(
    folder: &Path,
    listing: &Listing,
    extensions: &[&str],
) -> Result<Option<Vec<Timed>>, CaptureError> {
    let images = || listing.files.iter().filter(|name| has_extension(name, extensions));
    let timed = |name: &String| Some(Timed { time_ns: time_of_name(name)?, path: folder.join(name) });
    let list: Vec<Timed> = images().filter_map(timed).collect();
    match images().find(|name| time_of_name(name).is_none()) {
        _ if list.is_empty() => Ok(None),
        None => Ok(Some(list)),
        Some(other) => {
            let reason = format!(
                "is named by a time, but {other} beside it is not; name all images by times or all by numbers",
            );
            Err(CaptureError::format(&list[0].path, reason))
        }
    }
}

/// The time that a file's name is, nanoseconds: seconds with a fraction (`1617685268.377345.png`), or a Unix time in
/// milliseconds, microseconds or nanoseconds, which is recognised by its 13, 16 or 19 digits.
pub(super) fn time_of_name(name: &str) -> Option<i64> {
    let (stem, _) = name.rsplit_once('.')?;
    let all_digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    if let Some((whole, fraction)) = stem.split_once('.') {
        return if all_digits(whole) && all_digits(fraction) { parse_seconds(stem) } else { None };
    }
    let factor = match stem.len() {
        13 => 1_000_000,
        16 => 1_000,
        19 => 1,
        _ => return None,
    };
    stem.parse::<i64>().ok().filter(|_| all_digits(stem))?.checked_mul(factor)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn timed(milliseconds: &[i64]) -> Vec<Timed> {
        let one = |&ms: &i64| Timed { time_ns: ms * 1_000_000, path: PathBuf::from(format!("{ms}")) };
        milliseconds.iter().map(one).collect()
    }

    #[test]
    fn pairs_each_image_once_with_the_nearest() {
        let entries = pair_by_time(timed(&[0, 30, 60, 200]), timed(&[5, 33, 38, 61, 400]));
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

    #[test]
    fn names_that_are_times_are_distinguished_from_numbers() {
        assert_eq!(time_of_name("1617685268.377345.png"), Some(1_617_685_268_377_345_000));
        assert_eq!(time_of_name("12.5.jpg"), Some(12_500_000_000));
        assert_eq!(time_of_name("1617685268377.png"), Some(1_617_685_268_377_000_000));
        assert_eq!(time_of_name("1617685268377345.png"), Some(1_617_685_268_377_345_000));
        assert_eq!(time_of_name("1617685268377345123.png"), Some(1_617_685_268_377_345_123));
        assert_eq!(time_of_name("9999999999999999999.png"), None, "does not fit");
        for name in ["000012.png", "depth_1.5.png", "18446744073709551615.png", "a.b.png", "1..png", "depth"] {
            assert_eq!(time_of_name(name), None, "{name}");
        }
    }
}
