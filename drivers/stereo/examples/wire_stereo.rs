//! The wire tier's two ends for a side-by-side camera (see `tests/wire/`).
//!
//! `wire_stereo write FOLDER` (before the boot): the rig's settings, its calibration and what its cameras see;
//! `wire_stereo serve FOLDER` (within the virtual machine): plugs the model into the kernel's virtual host controller and
//! serves it until killed;
//! `wire_stereo check FOLDER TAKE COUNT` (anywhere): compares the first COUNT frames of a take: colour with what was sent,
//! depth with the matcher's of the same pictures.
#![allow(clippy::print_stdout)]

#[path = "../tests/scene/mod.rs"]
#[allow(clippy::unwrap_used, dead_code)]
mod scene;

use std::{
    error::Error,
    fs,
    path::Path,
    sync::{Arc, Mutex},
    thread,
    time::Duration,
};

use toile_capture::{ColorImage, DepthImage, Frame, RgbImage};
use toile_driver_simulated::{
    proof::{self, Shown, same},
    side_by_side::{self, Views},
    uvc::Wire,
    vhci,
};
use toile_driver_stereo::{Cameras, StereoSettings};
use toile_stereo::{DepthFromPair, DepthSettings, Lens, StereoCalibration, read_calibration, rectify};

/// The camera waits this long between frames: the matcher takes an emulated processor most of a second.
const PACE: Duration = Duration::from_secs(1);
/// Number of frames that differ.
const FRAMES: u64 = 5;
/// Columns and rows of one view.
const SIZE: (u32, u32) = scene::SIZE;

type Outcome<T> = Result<T, Box<dyn Error>>;

fn main() -> Outcome<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words[..] {
        ["write", folder] => write(Path::new(folder))?,
        ["serve", folder] => {
            let model = side_by_side::model(Scene::read(Path::new(folder))?, Wire::Isochronous);
            // The kernel lets go when it is asked to; what was being written then is of no use to it.
            if let Err(error) = vhci::plug(Arc::new(Mutex::new(model)))?.wait() {
                println!("server: {error}");
            }
        }
        ["check", folder, take, count] => {
            let sent = sent(Path::new(folder))?;
            println!("{}", proof::take(Path::new(take), count.parse()?, |frame| shown(frame, &sent))?);
        }
        _ => return Err("write FOLDER | serve FOLDER | check FOLDER TAKE COUNT".into()),
    }
    Ok(())
}

fn settings() -> StereoSettings {
    StereoSettings {
        name: "pair".into(),
        cameras: Cameras::SideBySide { node: "/dev/video0".into() },
        width: SIZE.0,
        height: SIZE.1,
        fps: 30.0,
        calibration: vec!["calibration.yml".into()],
        metres_per_unit: 1.0,
        alpha: 0.0,
        depth: DepthSettings { near: 0.8, far: 3.0, ..DepthSettings::default() },
    }
}

fn write(folder: &Path) -> Outcome<()> {
    fs::create_dir_all(folder)?;
    fs::write(folder.join("stereo.toml"), toml::to_string(&settings())?)?;
    fs::write(folder.join("calibration.yml"), yaml(&scene::calibration()))?;
    let (left, right) = scene::pictures();
    let width = SIZE.0 as usize;
    let rows = left.pixels.chunks(width).zip(right.pixels.chunks(width));
    let bytes: Vec<u8> = rows.flat_map(|(l, r)| l.iter().chain(r).map(|p| p[1])).collect();
    Ok(fs::write(folder.join("views"), bytes)?)
}

/// As OpenCV writes a calibration.
fn yaml(calibration: &StereoCalibration) -> String {
    let matrix = |name: &str, rows: usize, data: &[f64]| {
        let numbers: Vec<String> = data.iter().map(|x| format!("{x:e}")).collect();
        let cols = data.len() / rows;
        let data = numbers.join(", ");
        format!("{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {cols}\n   dt: d\n   data: [ {data} ]\n")
    };
    let camera = |l: &Lens| [l.fx, 0.0, l.cx, 0.0, l.fy, l.cy, 0.0, 0.0, 1.0];
    let StereoCalibration { left, right, right_from_left, .. } = calibration;
    let turn = right_from_left.rotation.to_rotation_matrix().into_inner().transpose();
    let parts = [
        matrix("M1", 3, &camera(left)),
        matrix("D1", 1, &left.distortion),
        matrix("M2", 3, &camera(right)),
        matrix("D2", 1, &right.distortion),
        matrix("R", 3, turn.as_slice()),
        matrix("T", 3, right_from_left.translation.vector.as_slice()),
    ];
    format!("%YAML:1.0\n---\nimage_width: {}\nimage_height: {}\n{}", SIZE.0, SIZE.1, parts.concat())
}

/// Brightness of both views, a little brighter with every frame.
struct Scene(Vec<u8>);

impl Scene {
    fn read(folder: &Path) -> Outcome<Self> {
        Ok(Self(fs::read(folder.join("views"))?))
    }

    fn of(&self, frame: u64) -> Vec<u8> {
        let more = 4 * (frame % FRAMES) as u8;
        self.0.iter().map(|y| y.saturating_add(more)).collect()
    }
}

impl Views for Scene {
    fn size(&self) -> (u16, u16) {
        (2 * SIZE.0 as u16, SIZE.1 as u16)
    }

    fn brightness(&mut self, frame: u64) -> Vec<u8> {
        thread::sleep(PACE);
        self.of(frame)
    }
}

/// The expected content of each frame that differs: depth and colour.
fn sent(folder: &Path) -> Outcome<Vec<(DepthImage, RgbImage)>> {
    let settings = settings();
    let calibration = read_calibration(&[folder.join("calibration.yml")], settings.metres_per_unit)?;
    let rectification = rectify(&calibration, SIZE, Some(settings.alpha))?;
    let matcher = DepthFromPair::new(rectification, settings.depth)?;
    let scene = Scene::read(folder)?;
    let frame = |k: u64| {
        let shown: Vec<[u8; 3]> = scene.of(k).into_iter().map(grey).collect();
        let width = SIZE.0 as usize;
        let view = |side: usize| {
            let rows = shown.chunks(2 * width);
            let pixels = rows.flat_map(|row| row[side * width..][..width].to_vec()).collect();
            RgbImage { width: SIZE.0, height: SIZE.1, pixels }
        };
        let found = matcher.depth(&view(0), &view(1))?;
        Ok((found.depth, found.left))
    };
    (0..FRAMES).map(frame).collect()
}

/// YUYV without colour, converted: brightness from 16..235 to 0..255.
fn grey(y: u8) -> [u8; 3] {
    [((298 * (i32::from(y) - 16) + 128) >> 8).clamp(0, 255) as u8; 3]
}

/// A frame beside what the model sent under the kernel's number of it.
fn shown(frame: &Frame, sent: &[(DepthImage, RgbImage)]) -> Shown {
    let (depth, colors) = &sent[(frame.device_frame % FRAMES) as usize];
    let (Some(seen), Some(ColorImage::Rgb(image))) = (&frame.depth, &frame.color) else {
        return Err("depth or colour is missing".into());
    };
    same("colour", &image.pixels, &colors.pixels)?;
    same("depth", &seen.values, &depth.values)?;
    Ok(Some(frame.device_frame))
}
