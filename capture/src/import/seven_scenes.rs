//! `seven-scenes`: Microsoft 7-Scenes folders (Shotton et al. 2013): `frame-N.depth.png` in millimetres with 65535 for
//! "none", `frame-N.color.jpg` (or .png), `frame-N.pose.txt` (camera to world), `camera-intrinsics.txt` (3×3).

use std::{collections::BTreeMap, path::Path};

use toile_geometry::camera::PinholeCamera;

use super::{
    camera_file::{self, CameraFile},
    images,
    inventory::{DEFAULT_FPS, FolderSource, Listing, last_number, pair, steady_time},
};
use crate::{CaptureError, files::read_text};

const DEPTH_SCALE: f64 = 0.001;
const MISSING: u16 = 65535;
/// The calibration that the data set itself recommends for 640×480.
const DEFAULT_INTRINSICS: [f64; 4] = [585.0, 585.0, 320.0, 240.0];

pub(super) fn open(path: &Path, listing: &Listing) -> Result<FolderSource, CaptureError> {
    let depth = listing.numbered(path, |name| numbered(name, ".depth.png"))?;
    let color = |name: &str| numbered(name, ".color.jpg").or_else(|| numbered(name, ".color.png"));
    let color = listing.numbered(path, color)?;
    let Some(first) = depth.values().next() else {
        return Err(CaptureError::format(path, "there is no frame-N.depth.png in this folder"));
    };
    let camera = read_camera(path, listing, images::file_size(first)?)?;
    let fps = camera.fps.unwrap_or(DEFAULT_FPS);
    let rig = camera.rig("seven-scenes", DEPTH_SCALE, fps, !color.is_empty());
    let entries = pair(depth, color, BTreeMap::new(), |_, number| steady_time(number, fps));
    FolderSource::new(path, rig, entries, Some(MISSING))
}

/// True for names such as `frame-000000.depth.png`.
pub(super) fn is_depth(name: &str) -> bool {
    numbered(name, ".depth.png").is_some()
}

pub(super) fn numbered(name: &str, suffix: &str) -> Option<u64> {
    name.strip_prefix("frame-").and_then(|rest| rest.strip_suffix(suffix)).and_then(last_number)
}

fn read_camera(folder: &Path, listing: &Listing, size: (u32, u32)) -> Result<CameraFile, CaptureError> {
    let (width, height) = size;
    if listing.files.iter().any(|name| name == "camera-intrinsics.txt") {
        let path = folder.join("camera-intrinsics.txt");
        let text = read_text(&path)?;
        let numbers: Option<Vec<f64>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
        let camera =
            numbers.filter(|k| k.len() == 9).map(|k| PinholeCamera::ideal(width, height, k[0], k[4], k[2], k[5]));
        return camera
            .filter(PinholeCamera::is_valid)
            .map(CameraFile::ideal)
            .ok_or_else(|| CaptureError::format(&path, "must hold a 3x3 camera matrix: fx 0 cx, 0 fy cy, 0 0 1"));
    }
    if let Some(file) = camera_file::find(folder)? {
        return camera_file::read(&file);
    }
    if size == (640, 480) {
        let [fx, fy, cx, cy] = DEFAULT_INTRINSICS;
        return Ok(CameraFile::ideal(PinholeCamera::ideal(width, height, fx, fy, cx, cy)));
    }
    Err(CaptureError::format(&folder.join("camera-intrinsics.txt"), "is missing: it must hold the 3x3 camera matrix"))
}
