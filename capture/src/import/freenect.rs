//! Folders that libfreenect's `record` writes for its simulated device: `INDEX.txt` names `d-TIME-STAMP.pgm` (depth, 16 bits in
//! the machine's order of bytes, which is little-endian although PGM says otherwise) and `r-TIME-STAMP.ppm` (colour).

use std::path::{Path, PathBuf};

use toile_geometry::{Rigid, camera::PinholeCamera};

use super::{
    inventory::Listing,
    stored::{Album, StoredSource, fps, shots},
};
use crate::{
    CaptureError, ColorImage, DepthImage, DeviceIdentity, Rig, Sensor, files::MAX_IMAGE_BYTES, files::read_limited,
    frame::rgb_image, trajectory::parse_seconds,
};

/// Disparities have 11 bits, of which the largest says "nothing seen".
const DISPARITIES: u16 = 2048;
/// What the device's makers call the usual conversion: metres = 1 / (A · disparity + B) (S. Magnenat's fit over Kinects).
const A: f64 = -0.003_071_101_6;
const B: f64 = 3.330_949_516_1;

/// True for a folder of such files.
pub(super) fn is_here(listing: &Listing) -> bool {
    listing.files.iter().any(|name| name == "INDEX.txt")
        && listing.files.iter().any(|name| time_of(name, "d-").is_some())
}

/// Opens a folder.
///
/// # Errors
/// [`CaptureError`] where there is no depth in it or its first picture cannot be read.
pub(super) fn open(path: &Path, listing: &Listing) -> Result<StoredSource, CaptureError> {
    let list = |prefix: &str| -> Vec<(i64, PathBuf)> {
        let timed = |name: &String| Some((time_of(name, prefix)?, path.join(name)));
        let mut list: Vec<(i64, PathBuf)> = listing.files.iter().filter_map(timed).collect();
        list.sort();
        list
    };
    let (depth, color) = (list("d-"), list("r-"));
    let first = depth.first().ok_or_else(|| CaptureError::format(path, "there is no d-TIME-STAMP.pgm in it"))?;
    let (width, height, values) = read_depth(&first.1).map_err(|reason| CaptureError::format(&first.1, reason))?;
    let is_disparity = values.iter().all(|value| *value < DISPARITIES);
    let times = |list: &[(i64, PathBuf)]| list.iter().map(|(time, _)| *time).collect::<Vec<i64>>();
    // Only depth that the library registered belongs to the colour camera, and only that is in millimetres.
    let used: Vec<(i64, PathBuf)> = if is_disparity { Vec::new() } else { color.clone() };
    let shots = shots(&times(&depth), &times(&used));
    let mut remarks = Vec::new();
    if is_disparity {
        remarks
            .push("depth is in disparities; it is converted by the usual formula for this kind of camera".to_string());
        if !color.is_empty() {
            remarks.push("colour is left out: where its camera stands to depth is not in the recording".into());
        }
    }
    let focal = if is_disparity { 580.0 } else { 525.0 };
    let scale = f64::from(width) / 640.0;
    let centre = |size: u32| (f64::from(size) - 1.0) / 2.0;
    let camera = PinholeCamera::ideal(width, height, focal * scale, focal * scale, centre(width), centre(height));
    let sensor = Sensor {
        name: "camera".into(),
        identity: DeviceIdentity {
            model: "import:freenect".into(),
            calibration_assumed: true,
            ..DeviceIdentity::default()
        },
        depth: camera,
        depth_scale: 0.001,
        color: (!used.is_empty()).then_some(camera),
        color_from_depth: Rigid::identity(),
        rig_from_depth: Rigid::identity(),
        fps: fps(&shots),
    };
    let files = |list: Vec<(i64, PathBuf)>| list.into_iter().map(|(_, file)| file).collect();
    let album = Dump { depth: files(depth), color: files(used), is_disparity };
    StoredSource::new(path.to_path_buf(), Rig { sensors: vec![sensor] }, shots, Box::new(album), remarks)
}

/// The time in a name such as `d-1355266541.912534-2683456724.pgm`, nanoseconds.
fn time_of(name: &str, prefix: &str) -> Option<i64> {
    let (stem, extension) = name.strip_prefix(prefix)?.rsplit_once('.')?;
    let (time, _) = stem.rsplit_once('-')?;
    ["pgm", "ppm"].contains(&extension).then(|| parse_seconds(time)).flatten()
}

#[derive(Debug)]
struct Dump {
    depth: Vec<PathBuf>,
    color: Vec<PathBuf>,
    is_disparity: bool,
}

impl Album for Dump {
    fn depth(&mut self, k: usize) -> Result<DepthImage, String> {
        let (width, height, mut values) = read_depth(&self.depth[k])?;
        if self.is_disparity {
            values.iter_mut().for_each(|value| *value = depth_of(*value));
        }
        Ok(DepthImage { width, height, values })
    }

    fn color(&mut self, k: usize) -> Result<ColorImage, String> {
        let bytes = read(&self.color[k])?;
        let (kind, width, height, _, pixels) = portable(&bytes).ok_or("is not a PPM picture")?;
        rgb_image(width, height, pixels).filter(|_| kind == b'6').ok_or_else(|| "is not a whole PPM picture".into())
    }
}

fn read(path: &Path) -> Result<Vec<u8>, String> {
    read_limited(path, MAX_IMAGE_BYTES).map_err(|error| error.reason())
}

/// Columns, rows and values of a PGM of 16 bits.
fn read_depth(path: &Path) -> Result<(u32, u32, Vec<u16>), String> {
    let bytes = read(path)?;
    let (kind, width, height, most, pixels) = portable(&bytes).ok_or("is not a PGM picture")?;
    let count = width as usize * height as usize;
    if kind != b'5' || most < 256 || pixels.len() != 2 * count {
        return Err("is not a whole PGM picture of 16 bits".into());
    }
    Ok((width, height, pixels.as_chunks::<2>().0.iter().map(|b| u16::from_le_bytes(*b)).collect()))
}

/// Kind, columns, rows, largest value and pixels of a PGM or PPM.
fn portable(bytes: &[u8]) -> Option<(u8, u32, u32, u32, &[u8])> {
    let kind = *bytes.strip_prefix(b"P")?.first()?;
    let mut rest = &bytes[2..];
    let mut number = || {
        let start = rest.iter().position(|b| !b.is_ascii_whitespace())?;
        let end = start + rest[start..].iter().position(|b| !b.is_ascii_digit())?;
        let number = std::str::from_utf8(&rest[start..end]).ok()?.parse::<u32>().ok()?;
        rest = &rest[end..];
        Some(number)
    };
    let (width, height, most) = (number()?, number()?, number()?);
    (width <= 8192 && height <= 8192).then_some((kind, width, height, most, rest.get(1..)?))
}

/// A disparity in millimetres; 0 where nothing was seen.
fn depth_of(disparity: u16) -> u16 {
    let metres = 1.0 / (A * f64::from(disparity) + B);
    if disparity < DISPARITIES - 1 && (0.0..=10.0).contains(&metres) { (1000.0 * metres).round() as u16 } else { 0 }
}

/// Reads a picture; for `fuzz/`.
pub(super) fn parse(bytes: &[u8]) {
    let _ = portable(bytes);
}
