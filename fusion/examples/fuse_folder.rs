//! Fuses a folder of frames and writes scan.ply, trajectory.tum, report.json and timings.json, for measuring.
//!
//! `cargo run --release -p toile-fusion --example fuse_folder -- FOLDER OUT [key=value ...]` with keys voxel, trunc,
//! volume=all, prior=none, poses=TUM, triangles, closing, refine, fill=0, smooth, every.

use std::{error::Error, fs, path::Path, sync::Arc};

use toile_capture::{CaptureError, ColorImage, DepthImage, DeviceIdentity, Frame, Rig, Sensor, Source};
use toile_fusion::{FusionSettings, KnownPose, Prior, Volume, fuse};
use toile_geometry::{Rigid, camera::PinholeCamera, ply};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, out, options @ ..] = arguments.as_slice() else { return Err("FOLDER OUT [key=value ...]".into()) };
    let mut settings = FusionSettings::default();
    let mut every = 1;
    for option in options {
        let (key, value) = option.split_once('=').ok_or("options are key=value")?;
        match key {
            "voxel" => settings.voxel_size = value.parse()?,
            "trunc" => settings.truncation = value.parse()?,
            "volume" => settings.volume = if value == "all" { Volume::All } else { Volume::Auto },
            "prior" => settings.prior = if value == "none" { Prior::None } else { Prior::Turntable },
            "poses" => settings.poses = Some(read_tum(Path::new(value))?),
            "triangles" => settings.target_triangles = value.parse()?,
            "closing" => settings.closing_rounds = value.parse()?,
            "refine" => settings.refine_rounds = value.parse()?,
            "fill" => settings.fill_holes = value != "0",
            "smooth" => settings.smoothing_passes = value.parse()?,
            "every" => every = value.parse()?,
            _ => return Err(format!("unknown option {key}").into()),
        }
    }
    let mut source = Folder::open(Path::new(folder), every)?;
    let scan = fuse(&mut source, &settings, &|_| {})?;
    let out = Path::new(out);
    fs::create_dir_all(out)?;
    ply::write(&out.join("scan.ply"), &scan.mesh)?;
    fs::write(out.join("trajectory.tum"), scan.trajectory_tum())?;
    fs::write(out.join("report.json"), serde_json::to_string_pretty(&scan.report)?)?;
    fs::write(out.join("timings.json"), serde_json::to_string_pretty(&scan.timings)?)?;
    Ok(())
}

/// A folder of numbered depth and colour images in one of the layouts of the private test data.
struct Folder {
    rig: Rig,
    files: Vec<(std::path::PathBuf, Option<std::path::PathBuf>, i64)>,
    next: usize,
}

impl Folder {
    fn open(folder: &Path, every: usize) -> Result<Self, Box<dyn Error>> {
        let depth_folder = if folder.join("depth").is_dir() { folder.join("depth") } else { folder.to_path_buf() };
        let depth = list(&depth_folder, |n| n.ends_with(".png") && !n.contains("mask"))?;
        let color = match folder.join("color").is_dir() {
            true => list(&folder.join("color"), |_| true)?,
            false => list(folder, |n| n.ends_with(".jpg") && !n.contains("mask"))?,
        };
        let times: Vec<i64> = match fs::read_to_string(folder.join("timestamps.txt")) {
            Ok(text) => text.lines().filter_map(|l| l.trim().parse().ok()).collect(),
            Err(_) => (0..depth.len() as i64).map(|k| k * 1_000_000_000 / 30).collect(),
        };
        let files = depth.into_iter().enumerate().map(|(i, d)| (d, color.get(i).cloned(), times[i]));
        let files = files.step_by(every).collect();
        Ok(Self { rig: Rig { sensors: vec![sensor(folder)?] }, files, next: 0 })
    }
}

fn sensor(folder: &Path) -> Result<Sensor, Box<dyn Error>> {
    let json = ["camera.json", "../intrinsics.json"].iter().find_map(|n| fs::read_to_string(folder.join(n)).ok());
    let depth = match json {
        Some(text) => {
            let v: serde_json::Value = serde_json::from_str(&text)?;
            let number = |k: &str| v[k].as_f64().unwrap_or(0.0);
            let size = (number("width") as u32, number("height") as u32);
            PinholeCamera::ideal(size.0, size.1, number("fx"), number("fy"), number("cx"), number("cy"))
        }
        None if folder.join("camera-intrinsics.txt").is_file() => {
            PinholeCamera::ideal(640, 480, 585.0, 585.0, 320.0, 240.0)
        }
        None => PinholeCamera::ideal(640, 480, 525.0, 525.0, 320.0, 240.0),
    };
    Ok(Sensor {
        name: "depth".into(),
        identity: DeviceIdentity::default(),
        depth,
        depth_scale: 0.001,
        color: Some(depth),
        color_from_depth: Rigid::identity(),
        rig_from_depth: Rigid::identity(),
        fps: 0.0,
    })
}

fn list(folder: &Path, keep: impl Fn(&str) -> bool) -> Result<Vec<std::path::PathBuf>, Box<dyn Error>> {
    let mut files: Vec<_> = fs::read_dir(folder)?.filter_map(|e| e.ok().map(|e| e.path())).collect();
    files.retain(|p| p.is_file() && p.file_name().and_then(|n| n.to_str()).is_some_and(&keep));
    files.sort();
    Ok(files)
}

fn read_tum(path: &Path) -> Result<Vec<KnownPose>, Box<dyn Error>> {
    let pose = |line: &str| {
        let v: Vec<f64> = line.split_whitespace().filter_map(|x| x.parse().ok()).collect();
        let [t, x, y, z, i, j, k, w] = v[..] else { return None };
        let rotation = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, i, j, k));
        let scan_from_camera = nalgebra::Isometry3::from_parts(nalgebra::Translation3::new(x, y, z), rotation);
        Some(KnownPose { device_time_ns: (t * 1e9).round() as i64, scan_from_camera })
    };
    Ok(fs::read_to_string(path)?.lines().filter(|l| !l.starts_with('#')).filter_map(pose).collect())
}

impl Source for Folder {
    fn rig(&self) -> &Rig {
        &self.rig
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, CaptureError> {
        let Some((depth, color, time)) = self.files.get(self.next).cloned() else { return Ok(None) };
        self.next += 1;
        let read = |path: &Path| fs::read(path).map_err(|e| CaptureError::io(path, e));
        let image = image::load_from_memory(&read(&depth)?)
            .map_err(|e| CaptureError::format(&depth, e.to_string()))?
            .to_luma16();
        let color = match color {
            Some(path) => Some(ColorImage::Jpeg(Arc::from(read(&path)?))),
            None => None,
        };
        Ok(Some(Frame {
            sensor: 0,
            index: self.next as u64 - 1,
            device_frame: self.next as u64 - 1,
            lost_before: 0,
            device_time_ns: time,
            host_time_ns: time,
            depth: Some(Arc::new(DepthImage {
                width: image.width(),
                height: image.height(),
                values: image.into_raw(),
            })),
            color,
        }))
    }

    fn frame_count(&self) -> Option<u64> {
        Some(self.files.len() as u64)
    }
}
