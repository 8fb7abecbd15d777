//! Record3D (iPhone, iPad): an `.r3d` archive, or the folder that it unpacks to: `metadata` (JSON) and in `rgbd/` for each
//! frame `N.jpg` and `N.depth`, which is LZFSE of floats in metres. Depth is registered to colour and smaller than it.

use std::path::{Path, PathBuf};

use serde::Deserialize;
use toile_geometry::{Rigid, camera::PinholeCamera};

use super::{
    inventory::steady_time,
    stored::{Album, Shot, StoredSource, fps, millimetres},
    zip::Archive,
};
use crate::{
    CaptureError, ColorImage, DepthImage, DeviceIdentity, Rig, Sensor, encoded,
    files::{MAX_IMAGE_BYTES, read_limited, read_text},
};

/// The sizes of depth of the cameras in these devices, columns and rows, held upright: the laser scanner's and the front camera's.
const SIZES: [(u32, u32); 2] = [(192, 256), (480, 640)];
/// Frames a second where the recording does not say any.
const FPS: f64 = 60.0;

/// The part of `metadata` that is read.
#[derive(Debug, Deserialize)]
struct Metadata {
    w: u32,
    h: u32,
    /// The camera matrix of colour, column by column.
    #[serde(rename = "K")]
    k: [f64; 9],
    #[serde(default)]
    fps: Option<f64>,
    #[serde(default)]
    dw: Option<u32>,
    #[serde(default)]
    dh: Option<u32>,
    /// Seconds.
    #[serde(default, rename = "frameTimestamps")]
    times: Vec<f64>,
}

/// Opens an archive or a folder.
///
/// # Errors
/// [`CaptureError`] that says what is missing.
pub(super) fn open(path: &Path) -> Result<StoredSource, CaptureError> {
    let mut album =
        if path.is_dir() { Files::Folder(path.to_path_buf()) } else { Files::Archive(Archive::open(path)?) };
    let text = match &mut album {
        Files::Folder(folder) => read_text(&folder.join("metadata"))?,
        Files::Archive(archive) => {
            let bytes =
                archive.read("metadata").map_err(|reason| CaptureError::format(path, format!("metadata {reason}")))?;
            String::from_utf8_lossy(&bytes).into_owned()
        }
    };
    let metadata: Metadata = serde_json::from_str(&text)
        .map_err(|error| CaptureError::format(path, format!("its metadata cannot be used: {error}")))?;
    let numbers = album.numbers(path)?;
    let first = numbers.first().map(|n| album.read(&format!("rgbd/{n}.depth")).and_then(|b| floats(&b)));
    let first = first.transpose().map_err(|reason| CaptureError::format(path, format!("its first depth {reason}")))?;
    let count = first.map_or(0, |values| values.len());
    let (depth, color) = cameras(&metadata, count).map_err(|reason| CaptureError::format(path, reason))?;
    let rate = metadata.fps.filter(|fps| (0.1..=1000.0).contains(fps)).unwrap_or(FPS);
    let (times, remarks) = times(&metadata, &numbers, rate);
    let shot = |(k, (&number, time_ns)): (usize, (&u64, i64))| Shot { number, time_ns, depth: Some(k), color: Some(k) };
    let shots: Vec<Shot> = numbers.iter().zip(times).enumerate().map(shot).collect();
    let sensor = Sensor {
        name: "camera".into(),
        identity: DeviceIdentity { model: "import:record3d".into(), ..DeviceIdentity::default() },
        depth,
        depth_scale: 0.001,
        color: Some(color),
        color_from_depth: Rigid::identity(),
        rig_from_depth: Rigid::identity(),
        fps: fps(&shots),
    };
    let album = Record3d { files: album, numbers, size: (depth.width, depth.height) };
    StoredSource::new(path.to_path_buf(), Rig { sensors: vec![sensor] }, shots, Box::new(album), remarks)
}

/// The times of frames: as they stand in the recording, else at a steady rate, which is said.
fn times(metadata: &Metadata, numbers: &[u64], rate: f64) -> (Vec<i64>, Vec<String>) {
    let stated = |n: &u64| metadata.times.get(usize::try_from(*n).ok()?).map(|seconds| (seconds * 1e9).round() as i64);
    let stated: Option<Vec<i64>> = numbers.iter().map(stated).collect();
    let rises = |times: &Vec<i64>| {
        times.windows(2).all(|pair| pair[1] > pair[0]) && times.first().is_some_and(|time| *time >= 0)
    };
    if let Some(times) = stated.filter(rises) {
        return (times, Vec::new());
    }
    let said = format!("the recording has no time for each frame; {rate} frames a second are assumed");
    (numbers.iter().map(|n| steady_time(*n, rate)).collect(), vec![said])
}

/// The cameras of depth, which has `count` pixels, and of colour.
fn cameras(metadata: &Metadata, count: usize) -> Result<(PinholeCamera, PinholeCamera), String> {
    let Metadata { w, h, k, .. } = metadata;
    let color = PinholeCamera::ideal(*w, *h, k[0], k[4], k[6], k[7]);
    if !color.is_valid() {
        return Err("its metadata do not say the calibration of a camera (w, h, K)".into());
    }
    let stated = metadata.dw.zip(metadata.dh);
    let turned = SIZES.map(|(a, b)| (b, a));
    let is_upright = h >= w;
    let known = if is_upright { SIZES } else { turned };
    let fits = |size: &(u32, u32)| size.0 as usize * size.1 as usize == count;
    let size = stated.filter(fits).or_else(|| known.into_iter().find(fits));
    let (dw, dh) =
        size.ok_or_else(|| format!("its depth has {count} values, which is the size of no camera that is known"))?;
    let (sx, sy) = (f64::from(dw) / f64::from(*w), f64::from(dh) / f64::from(*h));
    // Pixel centres are whole numbers: the corner of a picture lies at −0.5.
    let (cx, cy) = ((color.cx + 0.5) * sx - 0.5, (color.cy + 0.5) * sy - 0.5);
    Ok((PinholeCamera::ideal(dw, dh, color.fx * sx, color.fy * sy, cx, cy), color))
}

/// Floats from LZFSE.
fn floats(packed: &[u8]) -> Result<Vec<f32>, String> {
    let mut bytes = Vec::new();
    lzfse_rust::decode_bytes(packed, &mut bytes).map_err(|error| format!("cannot be unpacked: {error}"))?;
    Ok(bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect())
}

/// The files of a recording.
#[derive(Debug)]
enum Files {
    Folder(PathBuf),
    Archive(Archive),
}

impl Files {
    fn read(&mut self, name: &str) -> Result<Vec<u8>, String> {
        match self {
            Self::Folder(folder) => read_limited(&folder.join(name), MAX_IMAGE_BYTES).map_err(|error| error.reason()),
            Self::Archive(archive) => archive.read(name),
        }
    }

    /// The numbers of the frames that have depth, in their order.
    fn numbers(&self, path: &Path) -> Result<Vec<u64>, CaptureError> {
        let number = |name: &str| name.strip_suffix(".depth")?.parse::<u64>().ok();
        let mut numbers: Vec<u64> = match self {
            Self::Folder(folder) => {
                let listing = super::inventory::Listing::read(&folder.join("rgbd"))?;
                listing.files.iter().filter_map(|name| number(name)).collect()
            }
            Self::Archive(archive) => archive.names().filter_map(|name| number(name.strip_prefix("rgbd/")?)).collect(),
        };
        numbers.sort_unstable();
        if numbers.is_empty() {
            return Err(CaptureError::format(
                path,
                "there is no rgbd/N.depth in it: is it a recording of Record3D with depth?",
            ));
        }
        Ok(numbers)
    }
}

#[derive(Debug)]
struct Record3d {
    files: Files,
    numbers: Vec<u64>,
    size: (u32, u32),
}

impl Album for Record3d {
    fn depth(&mut self, k: usize) -> Result<DepthImage, String> {
        let values = floats(&self.files.read(&format!("rgbd/{}.depth", self.numbers[k]))?)?;
        let (width, height) = self.size;
        if values.len() != width as usize * height as usize {
            return Err(format!("has {} values instead of {width} x {height}", values.len()));
        }
        Ok(DepthImage { width, height, values: values.into_iter().map(millimetres).collect() })
    }

    fn color(&mut self, k: usize) -> Result<ColorImage, String> {
        let bytes = self.files.read(&format!("rgbd/{}.jpg", self.numbers[k]))?;
        encoded::size(&bytes).map(|_| ColorImage::Jpeg(bytes.into()))
    }
}

/// Unpacks floats; for `fuzz/`.
pub(super) fn parse(bytes: &[u8]) {
    let _ = floats(bytes);
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::Source;

    /// An archive with stored files, written from the public description.
    fn zip(files: &[(&str, Vec<u8>)]) -> Vec<u8> {
        let (mut bytes, mut list) = (Vec::new(), Vec::new());
        for (name, content) in files {
            let at = bytes.len() as u32;
            let sizes = [(content.len() as u32).to_le_bytes(), (content.len() as u32).to_le_bytes()].concat();
            let names = [(name.len() as u16).to_le_bytes(), [0; 2]].concat();
            bytes.extend(
                [
                    b"PK\x03\x04".to_vec(),
                    vec![0; 14],
                    sizes.clone(),
                    names.clone(),
                    name.as_bytes().to_vec(),
                    content.clone(),
                ]
                .concat(),
            );
            list.extend(
                [
                    b"PK\x01\x02".to_vec(),
                    vec![0; 16],
                    sizes,
                    names,
                    vec![0; 10],
                    at.to_le_bytes().to_vec(),
                    name.as_bytes().to_vec(),
                ]
                .concat(),
            );
        }
        let at = bytes.len() as u32;
        let count = (files.len() as u16).to_le_bytes();
        let end = [(list.len() as u32).to_le_bytes(), at.to_le_bytes()].concat();
        [bytes, list, b"PK\x05\x06".to_vec(), vec![0; 4], count.to_vec(), count.to_vec(), end, vec![0; 2]].concat()
    }

    fn frame(metres: f32) -> Vec<u8> {
        let raw: Vec<u8> = (0..192 * 256).flat_map(|k| (metres + (k % 192) as f32 * 1e-3).to_le_bytes()).collect();
        let mut packed = Vec::new();
        lzfse_rust::encode_bytes(&raw, &mut packed).unwrap();
        packed
    }

    fn files(times: &str) -> Vec<(&'static str, Vec<u8>)> {
        let mut jpeg = Vec::new();
        let picture = image::RgbImage::from_pixel(720, 960, image::Rgb([90, 90, 90]));
        picture.write_to(&mut std::io::Cursor::new(&mut jpeg), image::ImageFormat::Jpeg).unwrap();
        let metadata = format!(
            r#"{{"w": 720, "h": 960, "fps": 60, "K": [750, 0, 0, 0, 750, 0, 359.5, 479.5, 1], "poses": [] {times}}}"#
        );
        vec![
            ("metadata", metadata.into_bytes()),
            ("rgbd/10.depth", frame(3.0)),
            ("rgbd/10.jpg", jpeg.clone()),
            ("rgbd/9.depth", frame(2.0)),
            ("rgbd/9.jpg", jpeg),
        ]
    }

    #[test]
    fn archives_and_folders_give_the_same_frames_in_the_order_of_their_numbers() {
        let dir = tempfile::tempdir().unwrap();
        let archive = dir.path().join("me.r3d");
        fs::write(&archive, zip(&files(""))).unwrap();
        let folder = dir.path().join("me");
        fs::create_dir_all(folder.join("rgbd")).unwrap();
        files("").into_iter().for_each(|(name, bytes)| fs::write(folder.join(name), bytes).unwrap());
        for path in [archive, folder] {
            let mut source = open(&path).unwrap();
            let sensor = source.rig().sensors[0].clone();
            assert_eq!((sensor.depth.width, sensor.depth.height, sensor.color.unwrap().width), (192, 256, 720));
            assert!((sensor.depth.fx - 200.0).abs() < 1e-9 && (sensor.depth.cx - 95.5).abs() < 1e-9);
            assert!(source.remarks()[0].contains("60 frames a second are assumed"));
            let frame = source.next_frame().unwrap().unwrap();
            assert_eq!((frame.device_frame, frame.depth.unwrap().values[3]), (9, 2003));
            assert_eq!(frame.color.unwrap().decode(0).unwrap().height, 960);
        }
    }

    #[test]
    fn times_are_read_and_what_is_missing_is_said() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("me.r3d");
        let opened = |bytes: &[u8]| {
            fs::write(&path, bytes).unwrap();
            open(&path).map_err(|error| error.to_string())
        };
        let times: Vec<String> = (0..11).map(|k| format!("{}", f64::from(k) * 0.5)).collect();
        let mut source = opened(&zip(&files(&format!(", \"frameTimestamps\": [{}]", times.join(","))))).unwrap();
        assert!(source.remarks().is_empty());
        assert_eq!(source.next_frame().unwrap().unwrap().device_time_ns, 4_500_000_000);
        let whole = zip(&files(""));
        assert!(opened(&whole[..whole.len() - 30]).unwrap_err().contains("ZIP"));
        assert!(opened(&zip(&files("")[..1])).unwrap_err().contains("N.depth"));
        assert!(opened(&zip(&files("")[1..])).unwrap_err().contains("metadata"));
    }
}
