//! `uva`: a person turning before a fixed sensor (University of Amsterdam, Computer Vision 2): `N.jpg`, `N_depth.png` in
//! millimetres, `N_mask.jpg`, `N_camera.xml` (OpenCV storage with `intrinsic`, `R`, `t`); colour registered to depth.

use std::{collections::BTreeMap, path::Path};

use toile_geometry::camera::PinholeCamera;

use super::{
    camera_file::CameraFile,
    images,
    inventory::{DEFAULT_FPS, FolderSource, Listing, last_number, pair, steady_time},
};
use crate::{CaptureError, files::read_text};

const DEPTH_SCALE: f64 = 0.001;

pub(super) fn open(path: &Path, listing: &Listing, apply_mask: bool) -> Result<FolderSource, CaptureError> {
    let depth = listing.numbered(path, |name| numbered(name, "_depth.png"))?;
    let color = listing.numbered(path, |name| if name.contains('_') { None } else { numbered(name, ".jpg") })?;
    let masks = if apply_mask { listing.numbered(path, |name| numbered(name, "_mask.jpg"))? } else { BTreeMap::new() };
    let cameras = listing.numbered(path, |name| numbered(name, "_camera.xml"))?;
    let Some(camera) = cameras.values().next() else {
        return Err(CaptureError::format(path, "there is no N_camera.xml with the intrinsics in this folder"));
    };
    let Some(first) = depth.values().next() else {
        return Err(CaptureError::format(path, "there is no N_depth.png in this folder"));
    };
    let (width, height) = images::file_size(first)?;
    let k = read_matrix::<9>(camera, "intrinsic")?;
    let camera_model = PinholeCamera::ideal(width, height, k[0], k[4], k[2], k[5]);
    if !camera_model.is_valid() {
        return Err(CaptureError::field(camera, "intrinsic", "is not a camera matrix"));
    }
    let rig = CameraFile::ideal(camera_model).rig("uva", DEPTH_SCALE, DEFAULT_FPS, !color.is_empty());
    let entries = pair(depth, color, masks, |_, number| steady_time(number, DEFAULT_FPS));
    FolderSource::new(path, rig, entries, None)
}

/// True for names such as `0000000000_camera.xml`.
pub(super) fn is_camera(name: &str) -> bool {
    numbered(name, "_camera.xml").is_some()
}

pub(super) fn numbered(name: &str, suffix: &str) -> Option<u64> {
    name.strip_suffix(suffix).and_then(last_number)
}

/// The numbers of a matrix in an OpenCV XML storage.
pub(super) fn read_matrix<const N: usize>(path: &Path, name: &str) -> Result<[f64; N], CaptureError> {
    let text = read_text(path)?;
    parse_matrix(&text, name)
        .ok_or_else(|| CaptureError::field(path, name, format!("is missing, or does not have {N} numbers")))
}

pub(super) fn parse_matrix<const N: usize>(text: &str, name: &str) -> Option<[f64; N]> {
    let element = text.split_once(&format!("<{name} "))?.1.split_once(&format!("</{name}>"))?.0;
    let data = element.split_once("<data>")?.1.split_once("</data>")?.0;
    let numbers: Vec<f64> = data.split_whitespace().map(|word| word.parse().ok()).collect::<Option<_>>()?;
    numbers.try_into().ok().filter(|numbers: &[f64; N]| numbers.iter().all(|x| x.is_finite()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_opencv_matrices_and_refuses_others() {
        let text = "<R type_id=\"opencv-matrix\">\r\n<rows>1</rows><data>\r\n 1. -2.5e-001</data></R>";
        assert_eq!(parse_matrix::<2>(text, "R"), Some([1.0, -0.25]));
        assert_eq!(parse_matrix::<3>(text, "R"), None);
        assert_eq!(parse_matrix::<2>(text, "t"), None);
        assert_eq!(parse_matrix::<2>(&text.replace("1.", "x"), "R"), None);
    }
}
