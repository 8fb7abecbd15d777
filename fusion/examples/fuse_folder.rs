//! Fuses a folder of frames and writes scan.ply, trajectory.tum, report.json and timings.json, for measuring.
//!
//! `cargo run --release -p toile-fusion --example fuse_folder -- FOLDER OUT [key=value ...]` with keys voxel, trunc,
//! volume=all, prior=none, poses=TUM, triangles, closing, refine, fill=0, smooth, height, every.

use std::{error::Error, fs, path::Path};

use toile_capture::{CaptureError, Frame, Rig, Source, import};
use toile_fusion::{FusionSettings, KnownPose, Prior, Volume, fuse};
use toile_geometry::ply;

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
            "height" => settings.known_height = value.parse()?,
            "every" => every = value.parse()?,
            _ => return Err(format!("unknown option {key}").into()),
        }
    }
    let source = import::open(Path::new(folder), None)?;
    let mut source = Every { source, step: every };
    let scan = fuse(&mut source, &settings, &|_| {})?;
    let out = Path::new(out);
    fs::create_dir_all(out)?;
    ply::write(&out.join("scan.ply"), &scan.mesh)?;
    fs::write(out.join("trajectory.tum"), scan.trajectory_tum())?;
    fs::write(out.join("report.json"), serde_json::to_string_pretty(&scan.report)?)?;
    fs::write(out.join("timings.json"), serde_json::to_string_pretty(&scan.timings)?)?;
    Ok(())
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

/// Every `step`-th frame of a source.
struct Every {
    source: Box<dyn Source>,
    step: u64,
}

impl Source for Every {
    fn rig(&self) -> &Rig {
        self.source.rig()
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, CaptureError> {
        loop {
            match self.source.next_frame()? {
                Some(frame) if !frame.index.is_multiple_of(self.step) => {}
                other => return Ok(other),
            }
        }
    }
}
