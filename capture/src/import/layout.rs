//! Which layout a folder has, and opening it.

use std::{
    fmt,
    path::{Path, PathBuf},
    str::FromStr,
};

use super::{
    camera_file, folder,
    inventory::{Entry, FolderSource, Listing},
    seven_scenes, tum, uva,
};
use crate::{CaptureError, Replay, Source, printable};

/// The layouts that can be imported.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// `depth/`, `color/`, `camera.json`, `timestamps.txt`.
    ToileFolder,
    /// TUM RGB-D.
    Tum,
    /// University of Amsterdam's person turning before a sensor.
    Uva,
    /// Microsoft 7-Scenes.
    SevenScenes,
    /// A recording of Toile's own, or of another program with Foxglove's messages.
    Mcap,
}

impl Format {
    /// Every format, in the order in which they are listed to people.
    pub const ALL: [Self; 5] = [Self::ToileFolder, Self::Tum, Self::Uva, Self::SevenScenes, Self::Mcap];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::ToileFolder => "toile-folder",
            Self::Tum => "tum",
            Self::Uva => "uva",
            Self::SevenScenes => "seven-scenes",
            Self::Mcap => "mcap",
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Format {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let known = Self::ALL.into_iter().find(|format| format.name() == text);
        known.ok_or_else(|| format!("`{text}` is not a format; choose one of {}", names()))
    }
}

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
    if format == Format::Mcap {
        return Ok(Box::new(Replay::open(path)?));
    }
    Ok(Box::new(open_folder(path, format, options.apply_mask)?))
}

/// The files that decide what [`open`] gives of a folder: its own, its calibration's, and its frames' images.
///
/// # Errors
/// As [`open`].
pub fn files(path: &Path) -> Result<Vec<PathBuf>, CaptureError> {
    let source = open_folder(path, guess(path)?, false)?;
    let own = Listing::read(path)?.files.into_iter().map(|name| path.join(name));
    let of_entry = |entry: &Entry| [entry.depth.clone(), entry.color.clone(), entry.mask.clone()];
    let images = source.entries().iter().flat_map(of_entry).flatten();
    let all = own.chain(camera_file::find(path)?).chain(images);
    let mut files: Vec<PathBuf> = all.filter(|file| file.is_file()).collect();
    files.sort();
    files.dedup();
    Ok(files)
}

/// Guesses a folder's format from the names in it.
///
/// # Errors
/// [`CaptureError`] where there is no such folder or nothing in it is known; the message lists what is.
pub fn guess(path: &Path) -> Result<Format, CaptureError> {
    if path.exists() && !path.is_dir() {
        return Ok(Format::Mcap);
    }
    let listing = Listing::read(path)?;
    guess_listing(&listing).ok_or_else(|| unknown(path, &listing))
}

fn guess_listing(listing: &Listing) -> Option<Format> {
    let any = |test: &dyn Fn(&str) -> bool| listing.files.iter().any(|name| test(name));
    if any(&|name| name == "depth.txt") {
        Some(Format::Tum)
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
        Format::Mcap => Err(CaptureError::format(
            path,
            "is a folder, not a recording; leave --format out, or name the folder's layout",
        )),
    }
}

fn unknown(path: &Path, listing: &Listing) -> CaptureError {
    let inside = |name: &&String| Listing::read(&path.join(name)).is_ok_and(|inner| guess_listing(&inner).is_some());
    let hints: Vec<_> = listing.folders.iter().filter(inside).map(String::as_str).collect();
    let hint = if hints.is_empty() {
        format!("name its layout with --format ({}), or look at what is in the folder", names())
    } else {
        format!("did you mean a folder in it: {}?", printable(&hints.join(", ")))
    };
    CaptureError::format(path, format!("its layout of depth images is not known; {hint}"))
}

fn names() -> String {
    Format::ALL.map(Format::name).join(", ")
}
