//! `redwood`: folders of the Redwood data sets: `depth/NNNNNNN-TTTTTTTTTTTT.png` in millimetres and `rgb/` (or `image/`, `color/`)
//! likewise: a frame number and a time in microseconds; colour is registered to depth.

use std::path::{Path, PathBuf};

use toile_geometry::camera::PinholeCamera;

use super::{
    camera_file::{self, CameraFile},
    images,
    inventory::{DEFAULT_FPS, FolderSource, Listing, has_extension, measured_fps},
    timed::{Timed, pair_by_time},
};
use crate::CaptureError;

const DEPTH_SCALE: f64 = 0.001;
/// Names of the folder with colour.
const COLOR: [&str; 4] = ["rgb", "image", "color", "images"];

/// True for a folder whose `depth/` has such names.
pub(super) fn is_named_so(path: &Path) -> bool {
    Listing::read(&path.join("depth")).is_ok_and(|listing| {
        let mut images = listing.files.iter().filter(|name| has_extension(name, &["png"])).peekable();
        images.peek().is_some() && images.all(|name| time_of(name).is_some())
    })
}

pub(super) fn open(path: &Path, listing: &Listing) -> Result<FolderSource, CaptureError> {
    let depth = timed(&path.join("depth"), &["png"])?;
    let folder = COLOR.into_iter().find(|name| listing.folders.iter().any(|folder| folder == name));
    let color = folder.map(|name| timed(&path.join(name), &["jpg", "jpeg", "png"])).transpose()?.unwrap_or_default();
    let has_color = !color.is_empty();
    let first = depth.first().map(|timed| timed.path.clone());
    let entries = pair_by_time(depth, color);
    let camera = match camera_file::find(path)? {
        Some(file) => camera_file::read(&file)?,
        None => usual(path, first)?,
    };
    let fps = camera.fps.or_else(|| measured_fps(&entries)).unwrap_or(DEFAULT_FPS);
    FolderSource::new(path, camera.rig("redwood", DEPTH_SCALE, fps, has_color), entries, None)
}

fn timed(folder: &Path, extensions: &[&str]) -> Result<Vec<Timed>, CaptureError> {
    let listing = Listing::read(folder)?;
    let names = listing.files.iter().filter(|name| has_extension(name, extensions));
    Ok(names.filter_map(|name| Some(Timed { time_ns: time_of(name)?, path: folder.join(name) })).collect())
}

/// The time in a name such as `0000001-000000033369.png`, nanoseconds.
fn time_of(name: &str) -> Option<i64> {
    let (number, time) = name.rsplit_once('.')?.0.split_once('-')?;
    let digits = |text: &str| text.len() >= 5 && text.bytes().all(|b| b.is_ascii_digit());
    if digits(number) && digits(time) { time.parse::<i64>().ok()?.checked_mul(1000) } else { None }
}

/// The intrinsics that the data sets recommend for their 640 × 480 camera.
fn usual(path: &Path, first: Option<PathBuf>) -> Result<CameraFile, CaptureError> {
    let missing = || CaptureError::format(path, "there is no depth image in depth/");
    let size = images::file_size(&first.ok_or_else(missing)?)?;
    if size != (640, 480) {
        let reason =
            format!("is missing: the usual calibration is for 640 x 480, the images have {} x {}", size.0, size.1);
        return Err(CaptureError::format(&path.join("camera.json"), reason));
    }
    let camera = CameraFile::ideal(PinholeCamera::ideal(640, 480, 525.0, 525.0, 319.5, 239.5));
    Ok(CameraFile { is_assumed: true, ..camera })
}
