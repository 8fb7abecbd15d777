//! Which layout a folder has, and opening it.

use std::path::{Path, PathBuf};

use super::{
    associated, camera_file, folder,
    format::{Format, names},
    freenect,
    inventory::{Entry, FolderSource, Listing},
    matroska, oni, record3d, redwood, ros, sens, seven_scenes, sniff, stray, tum, uva,
};
use crate::{CaptureError, Replay, Source, printable};

/// How to import.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ImportOptions {
    /// The layout; guessed from the folder's content where it is `None`.
    pub format: Option<Format>,
    /// Set depth outside of the person masks to "missing", where a folder has masks (`uva`). Default: false, depth as
    /// it was measured.
    pub apply_mask: bool,
}

/// Opens a folder (or a recording) as a source of frames; the format is guessed where it is `None`.
///
/// # Errors
/// [`CaptureError`] that names the file or field that is missing or wrong.
pub fn open(path: &Path, format: Option<Format>) -> Result<Box<dyn Source>, CaptureError> {
    open_with(path, &ImportOptions { format, ..ImportOptions::default() })
}

/// [`open`] with all options.
///
/// # Errors
/// As [`open`].
pub fn open_with(path: &Path, options: &ImportOptions) -> Result<Box<dyn Source>, CaptureError> {
    let format = match options.format {
        Some(format) => format,
        None => guess(path)?,
    };
    Ok(match format {
        Format::Mcap => Box::new(Replay::open(path)?),
        Format::Bag => Box::new(ros::open_bag(path)?),
        Format::Ros2Bag => Box::new(ros::open_bag2(path)?),
        Format::RosMcap => Box::new(ros::open_mcap(path)?),
        Format::Oni => Box::new(oni::open(path)?),
        Format::Mkv => Box::new(matroska::open(path)?),
        Format::Sens => Box::new(sens::open(path)?),
        Format::Record3d => Box::new(record3d::open(path)?),
        Format::Freenect => Box::new(freenect::open(path, &Listing::read(path)?)?),
        _ => Box::new(open_folder(path, format, options.apply_mask)?),
    })
}

/// The files that decide what [`open`] gives of a folder: its own, its calibration's, and its frames' images.
///
/// # Errors
/// As [`open`].
pub fn files(path: &Path) -> Result<Vec<PathBuf>, CaptureError> {
    let format = guess(path)?;
    if matches!(format, Format::Record3d | Format::Freenect | Format::Ros2Bag) {
        return all_files(path);
    }
    let source = open_folder(path, format, false)?;
    let own = Listing::read(path)?.files.into_iter().map(|name| path.join(name));
    let of_entry = |entry: &Entry| [entry.depth.clone(), entry.color.clone(), entry.mask.clone()];
    let images = source.entries().iter().flat_map(of_entry).flatten();
    let all = own.chain(camera_file::find(path)?).chain(images);
    let mut files: Vec<PathBuf> = all.filter(|file| file.is_file()).collect();
    files.sort();
    files.dedup();
    Ok(files)
}

/// All files of a folder and of the folders in it.
fn all_files(path: &Path) -> Result<Vec<PathBuf>, CaptureError> {
    let listing = Listing::read(path)?;
    let mut files: Vec<PathBuf> =
        listing.files.iter().map(|name| path.join(name)).filter(|file| file.is_file()).collect();
    for folder in &listing.folders {
        let inner = path.join(folder);
        files.extend(Listing::read(&inner)?.files.iter().map(|name| inner.join(name)).filter(|file| file.is_file()));
    }
    files.sort();
    Ok(files)
}

/// Guesses a folder's format from the names in it.
///
/// # Errors
/// [`CaptureError`] where there is no such folder or nothing in it is known; the message lists what is.
pub fn guess(path: &Path) -> Result<Format, CaptureError> {
    if path.exists() && !path.is_dir() {
        return sniff::file(path);
    }
    let listing = Listing::read(path)?;
    guess_listing(path, &listing).ok_or_else(|| unknown(path, &listing))
}

fn guess_listing(path: &Path, listing: &Listing) -> Option<Format> {
    let any = |test: &dyn Fn(&str) -> bool| listing.files.iter().any(|name| test(name));
    if any(&|name| name == "depth.txt") {
        Some(Format::Tum)
    } else if associated::list_in(listing).is_some() {
        Some(Format::Associated)
    } else if stray::is_here(listing) {
        Some(Format::StrayScanner)
    } else if freenect::is_here(listing) {
        Some(Format::Freenect)
    } else if any(&|name| name == "metadata") && listing.folders.iter().any(|name| name == "rgbd") {
        Some(Format::Record3d)
    } else if ros::holds_bag2(listing) {
        Some(Format::Ros2Bag)
    } else if redwood::is_named_so(path) {
        Some(Format::Redwood)
    } else if listing.folders.iter().any(|name| name == "depth") {
        Some(Format::ToileFolder)
    } else if any(&|name| seven_scenes::is_depth(name)) {
        Some(Format::SevenScenes)
    } else if any(&|name| uva::is_camera(name)) {
        Some(Format::Uva)
    } else if any(&tum::is_paired_depth) {
        Some(Format::Tum)
    } else {
        None
    }
}

pub(super) fn open_folder(path: &Path, format: Format, apply_mask: bool) -> Result<FolderSource, CaptureError> {
    let listing = Listing::read(path)?;
    match format {
        Format::ToileFolder => folder::open(path, &listing),
        Format::Tum => tum::open(path, &listing),
        Format::Uva => uva::open(path, &listing, apply_mask),
        Format::SevenScenes => seven_scenes::open(path, &listing),
        Format::Redwood => redwood::open(path, &listing),
        Format::Associated => associated::open(path, &listing),
        Format::StrayScanner => stray::open(path, &listing),
        _ => Err(CaptureError::format(path, "is not read as a folder; leave --format out, or name its layout")),
    }
}

fn unknown(path: &Path, listing: &Listing) -> CaptureError {
    let inside = |name: &&String| {
        let inner = path.join(name);
        Listing::read(&inner).is_ok_and(|listing| guess_listing(&inner, &listing).is_some())
    };
    let hints: Vec<_> = listing.folders.iter().filter(inside).map(String::as_str).collect();
    let hint = if hints.is_empty() {
        format!("name its layout with --format ({}), or look at what is in the folder", names())
    } else {
        format!("did you mean a folder in it: {}?", printable(&hints.join(", ")))
    };
    CaptureError::format(path, format!("its layout of depth images is not known; {hint}"))
}
