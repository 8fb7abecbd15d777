//! `toile capture --color`: a webcam's colour beside a depth camera, paired by time.

#![allow(missing_docs, clippy::unwrap_used)]

mod common;

use std::{
    fs,
    path::{Path, PathBuf},
    sync::{Arc, Mutex},
};

use common::{exits, toile};
use toile_capture::{
    ColorImage, DeviceIdentity, Frame, Recorder, RecorderOptions, Replay, RgbImage, Rig, Sensor, Source,
};
use toile_driver_kinect1::{Kinect1, Settings, VideoMode};
use toile_driver_simulated::kinect1::{Pattern, SimulatedCamera};
use toile_driver_transport::simulated::SimulatedBus;
use toile_geometry::{Rigid, camera::PinholeCamera};

/// Frames of the depth camera: half a second.
const FRAMES: u64 = 15;

fn frames(path: &Path) -> Vec<Frame> {
    let replay = Replay::open(path).unwrap();
    assert!(replay.lost().is_none());
    (0..replay.len()).map(|i| replay.frame(i).unwrap()).collect()
}

fn write(path: &Path, rig: &Rig, frames: &[Frame]) {
    let mut recorder = Recorder::create(path, rig, RecorderOptions::default()).unwrap();
    frames.iter().for_each(|frame| recorder.write(frame).unwrap());
    recorder.finish().unwrap();
}

/// Depth of a simulated Kinect, and what a webcam beside it saw meanwhile: pictures of 8×6 whose red is their number, 4 ms
/// after every second depth frame.
fn record_both(folder: &Path) -> (PathBuf, PathBuf, Vec<Frame>) {
    let bus = SimulatedBus::default();
    bus.plug(Arc::new(Mutex::new(SimulatedCamera::new(Pattern::default()))));
    let settings = Settings { video: VideoMode::Off, ..Settings::default() };
    let mut kinect = Kinect1::open(&bus, None, settings).unwrap();
    let period = 1_000_000_000 / 30;
    let mut depth: Vec<Frame> = (0..FRAMES).map(|_| kinect.next_frame().unwrap().unwrap()).collect();
    // The simulated bus runs faster than the clock: host times as a real camera's are.
    depth.iter_mut().zip(0..).for_each(|(frame, k)| frame.host_time_ns = 1_000_000_000 + k * period);
    let camera = PinholeCamera::ideal(8, 6, 8.0, 8.0, 3.5, 2.5);
    let sensor = Sensor {
        name: "webcam".into(),
        identity: DeviceIdentity::default(),
        depth: camera,
        depth_scale: 0.001,
        color: Some(camera),
        color_from_depth: Rigid::identity(),
        rig_from_depth: Rigid::identity(),
        fps: 15.0,
    };
    let picture = |(k, of): (usize, &Frame)| Frame {
        index: k as u64 / 2,
        device_frame: k as u64 / 2,
        host_time_ns: of.host_time_ns + 4_000_000,
        depth: None,
        color: Some(ColorImage::Rgb(Arc::new(RgbImage { width: 8, height: 6, pixels: vec![[k as u8, 0, 0]; 48] }))),
        ..of.clone()
    };
    let pictures: Vec<Frame> = depth.iter().enumerate().step_by(2).map(picture).collect();
    let paths = ["depth.mcap", "webcam.mcap"].map(|name| folder.join(name));
    write(&paths[0], kinect.rig(), &depth);
    write(&paths[1], &Rig { sensors: vec![sensor] }, &pictures);
    let [depth_path, webcam] = paths;
    (depth_path, webcam, depth)
}

fn calibration(folder: &Path, width: u32) -> PathBuf {
    let path = folder.join("webcam.toml");
    let text = format!(
        "[camera]\nwidth = {width}\nheight = 6\nfx = 9.0\nfy = 9.0\ncx = 3.5\ncy = 2.5\n\
         [color_from_depth]\nposition = [0.05, 0.0, 0.0]\n"
    );
    fs::write(&path, text).unwrap();
    path
}

#[test]
fn each_depth_frame_has_the_nearest_picture_by_device_and_by_rig_file() {
    let dir = tempfile::tempdir().unwrap();
    let (depth, webcam, recorded) = record_both(dir.path());
    let color = format!("replay:{},{}", webcam.display(), calibration(dir.path(), 8).display());
    let device = format!("replay:{}", depth.display());
    let rig = dir.path().join("rig.toml");
    fs::write(&rig, format!("[[sensor]]\ndevice = \"{device}\"\ncolor = \"{color}\"\n")).unwrap();
    let rig = rig.display().to_string();
    for (name, words) in [("olga", vec!["--device", &device, "--color", &color]), ("anna", vec!["--rig", &rig])] {
        let subject = dir.path().join(name);
        let mut capture = toile();
        capture.args(["capture", "--layer", "body"]).args(words).arg("--subject").arg(&subject);
        exits(0, &mut capture);
        let take = subject.join("takes/00-body.mcap");
        let sensor = Replay::open(&take).unwrap().rig().sensors[0].clone();
        assert_eq!((sensor.color.unwrap().fx, sensor.color_from_depth.translation.x), (9.0, 0.05));
        let seen = frames(&take);
        assert_eq!(seen.len() as u64, FRAMES);
        for (k, frame) in seen.iter().enumerate() {
            assert!(frame.depth == recorded[k].depth && frame.device_time_ns == recorded[k].device_time_ns);
            let image = frame.color.as_ref().unwrap().decode(k as u64).unwrap();
            // Even frames have a picture 4 ms later; odd ones lie between two, 29 ms after the one before.
            let nearest = if k % 2 == 0 { k } else { k - 1 };
            assert_eq!(usize::from(image.pixels[0][0]), nearest, "{name} frame {k}");
        }
    }
}

#[test]
fn colour_that_cannot_be_put_beside_depth_is_refused_with_what_to_do() {
    let dir = tempfile::tempdir().unwrap();
    let (depth, webcam, _) = record_both(dir.path());
    let (device, webcam) = (format!("replay:{}", depth.display()), webcam.display().to_string());
    let refused = |code: i32, device: &str, color: &str| {
        let subject = dir.path().join("olga");
        let mut capture = toile();
        capture.args(["capture", "--layer", "body", "--device", device, "--color", color, "--subject"]).arg(&subject);
        let said = exits(code, &mut capture);
        assert!(!subject.exists());
        said["error"]["message"].as_str().unwrap().to_string()
    };
    let without = refused(2, &device, "webcam:0");
    assert!(without.contains("calibration") && without.contains("docs/devices.md"), "{without}");
    let size = calibration(dir.path(), 16).display().to_string();
    let other = refused(2, &device, &format!("replay:{webcam},{size}"));
    assert!(other.contains("8x6") && other.contains("16x6"), "{other}");
    let missing = refused(2, &device, &format!("replay:{webcam},nowhere.toml"));
    assert!(missing.contains("nowhere.toml"), "{missing}");
    let live = refused(2, &device, &format!("webcam:0,{size}"));
    assert!(live.contains("both live or neither"), "{live}");
}
