//! Stray Scanner (iPhone, iPad): `camera_matrix.csv`, `odometry.csv`, `depth/NNNNNN.png` in millimetres. Colour is a video
//! (`rgb.mp4`), which is not read; its frames as images in `rgb/` are.

use std::{collections::BTreeMap, path::Path};

use toile_geometry::camera::PinholeCamera;

use super::{
    camera_file::CameraFile,
    images,
    inventory::{DEFAULT_FPS, FolderSource, Listing, has_extension, last_number, measured_fps, pair, steady_time},
    timed::check_time,
};
use crate::{CaptureError, files::read_text, trajectory::parse_seconds};

const DEPTH_SCALE: f64 = 0.001;
/// Columns and rows of the app's video.
const VIDEO: (u32, u32) = (1920, 1440);

/// True for a folder of the app.
pub(super) fn is_here(listing: &Listing) -> bool {
    ["camera_matrix.csv", "odometry.csv"].iter().all(|name| listing.files.iter().any(|file| file == name))
}

pub(super) fn open(path: &Path, listing: &Listing) -> Result<FolderSource, CaptureError> {
    let number = |name: &str, extensions: &[&str]| last_number(name).filter(|_| has_extension(name, extensions));
    let depth_folder = path.join("depth");
    let depth = Listing::read(&depth_folder)?.numbered(&depth_folder, |name| number(name, &["png"]))?;
    let Some(first) = depth.values().next() else {
        return Err(CaptureError::format(
            &depth_folder,
            "holds no PNG images (older versions wrote .npy, which is not read)",
        ));
    };
    let mut color = BTreeMap::new();
    let has_images = listing.folders.iter().any(|folder| folder == "rgb");
    if has_images {
        let folder = path.join("rgb");
        color = Listing::read(&folder)?.numbered(&folder, |name| number(name, &["jpg", "jpeg", "png"]))?;
    }
    let picture = color.values().next().map(|file| images::file_size(file)).transpose()?;
    let size = images::file_size(first)?;
    let camera = read_camera(&path.join("camera_matrix.csv"), picture.unwrap_or(VIDEO))?;
    let depth_camera = scaled(&camera, size);
    let times = read_times(&path.join("odometry.csv"))?;
    let time = |_, number| times.get(&number).copied().unwrap_or_else(|| steady_time(number, DEFAULT_FPS));
    let has_color = !color.is_empty();
    let entries = pair(depth, color, BTreeMap::new(), time);
    let fps = measured_fps(&entries).unwrap_or(DEFAULT_FPS);
    let mut rig = CameraFile::ideal(depth_camera).rig("stray-scanner", DEPTH_SCALE, fps, has_color);
    rig.sensors.iter_mut().for_each(|sensor| sensor.color = sensor.color.map(|_| camera));
    let mut source = FolderSource::new(path, rig, entries, None)?;
    if !has_color && listing.files.iter().any(|file| file == "rgb.mp4") {
        let said = "colour is left out: rgb.mp4 is a video; turn it into images (`ffmpeg -i rgb.mp4 -start_number 0 rgb/%06d.jpg`) and \
                    import again";
        source.remarks.push(said.into());
    }
    Ok(source)
}

/// The camera of colour, from a matrix of three rows.
fn read_camera(path: &Path, (width, height): (u32, u32)) -> Result<PinholeCamera, CaptureError> {
    let text = read_text(path)?;
    let numbers: Vec<f64> = text.split([',', '\n', '\r', ' ']).filter_map(|word| word.trim().parse().ok()).collect();
    let camera = match numbers.as_slice() {
        [fx, _, cx, _, fy, cy, ..] => PinholeCamera::ideal(width, height, *fx, *fy, *cx, *cy),
        _ => return Err(CaptureError::format(path, "must hold a matrix of three rows of three numbers")),
    };
    if camera.is_valid() { Ok(camera) } else { Err(CaptureError::format(path, "is not the matrix of a camera")) }
}

/// The same camera with pixels of another size.
fn scaled(camera: &PinholeCamera, (width, height): (u32, u32)) -> PinholeCamera {
    let (sx, sy) = (f64::from(width) / f64::from(camera.width), f64::from(height) / f64::from(camera.height));
    let (cx, cy) = ((camera.cx + 0.5) * sx - 0.5, (camera.cy + 0.5) * sy - 0.5);
    PinholeCamera::ideal(width, height, camera.fx * sx, camera.fy * sy, cx, cy)
}

/// The times of frames by their numbers, from lines `timestamp, frame, x, y, z, qx, qy, qz, qw`.
fn read_times(path: &Path) -> Result<BTreeMap<u64, i64>, CaptureError> {
    let text = read_text(path)?;
    let mut times = BTreeMap::new();
    for (line, content) in text.lines().enumerate().skip(1).filter(|(_, line)| !line.trim().is_empty()) {
        let mut words = content.split(',').map(str::trim);
        let entry = words.next().and_then(parse_seconds).zip(words.next().and_then(|word| word.parse::<u64>().ok()));
        let wrong = |reason: String| CaptureError::format(path, format!("line {}: {reason}", line + 1));
        let (time_ns, number) = entry.ok_or_else(|| wrong("does not start with a time and a frame number".into()))?;
        check_time(time_ns).map_err(wrong)?;
        times.insert(number, time_ns);
    }
    Ok(times)
}
