//! Depth with the colour of a webcam beside it: the nearest picture in host time, whatever either camera does.
#![allow(clippy::unwrap_used)] // helpers of tests are not seen as tests

use std::{collections::VecDeque, sync::Arc, thread, time::Duration};

use toile_capture::{
    CaptureError, ClockDomain, ColorImage, DepthImage, DeviceIdentity, Frame, RgbImage, Rig, Sensor, Source,
};
use toile_driver_webcam::{ColorBeside, ColorCalibration};
use toile_geometry::{Rigid, camera::PinholeCamera};

const MS: i64 = 1_000_000;

/// A camera that gives these frames, then perhaps fails, then ends; each frame after a pause.
struct Script {
    rig: Rig,
    frames: VecDeque<Frame>,
    error: Option<CaptureError>,
    pause: Duration,
}

impl Source for Script {
    fn rig(&self) -> &Rig {
        &self.rig
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, CaptureError> {
        thread::sleep(self.pause);
        match self.frames.pop_front() {
            Some(frame) => Ok(Some(frame)),
            None => self.error.take().map_or(Ok(None), Err),
        }
    }
}

fn sensor(name: &str, fps: f64, color: Option<(u32, u32)>) -> Sensor {
    let camera = |(w, h): (u32, u32)| PinholeCamera::ideal(w, h, 5.0, 5.0, 1.0, 1.0);
    Sensor {
        name: name.into(),
        identity: DeviceIdentity { clock: ClockDomain::Device, ..DeviceIdentity::default() },
        depth: camera((2, 2)),
        depth_scale: 0.001,
        color: color.map(camera),
        color_from_depth: Rigid::identity(),
        rig_from_depth: Rigid::identity(),
        fps,
    }
}

fn frame(number: u64, host_time_ns: i64) -> Frame {
    Frame {
        sensor: 0,
        index: number,
        device_frame: number,
        lost_before: 0,
        device_time_ns: 77_000 * MS + host_time_ns,
        host_time_ns,
        depth: None,
        color: None,
    }
}

fn script(sensor: Sensor, frames: impl Iterator<Item = Frame>) -> Script {
    Script { rig: Rig { sensors: vec![sensor] }, frames: frames.collect(), error: None, pause: Duration::ZERO }
}

/// Depth at 30 Hz whose values are the frame's number.
fn depth_camera(count: u64) -> Script {
    let depth = |k: u64| DepthImage { width: 2, height: 2, values: vec![k as u16; 4] };
    let frames = (0..count).map(|k| Frame { depth: Some(Arc::new(depth(k))), ..frame(k, 33 * MS * k as i64) });
    script(sensor("depth", 30.0, None), frames)
}

/// Pictures of 4×3 at 25 Hz, the first at 7 ms, whose red is the picture's number.
fn webcam(count: u64) -> Script {
    let picture = |k: u64| RgbImage { width: 4, height: 3, pixels: vec![[k as u8, 0, 0]; 12] };
    let color = |k| Some(ColorImage::Rgb(Arc::new(picture(k))));
    let frames = (0..count).map(move |k| Frame { color: color(k), ..frame(k, picture_time(k)) });
    script(sensor("webcam", 25.0, Some((4, 3))), frames)
}

fn picture_time(k: u64) -> i64 {
    (7 + 40 * k as i64) * MS
}

fn calibration() -> ColorCalibration {
    let camera = PinholeCamera::ideal(4, 3, 9.0, 9.0, 1.5, 1.0);
    ColorCalibration { camera, color_from_depth: Rigid::translation(0.1, 0.0, 0.0) }
}

fn beside(depth: Script, color: Script, is_live: bool) -> ColorBeside {
    ColorBeside::new(Box::new(depth), Box::new(color), &calibration(), is_live).unwrap()
}

fn picture_of(frame: &Frame) -> Option<u64> {
    match &frame.color {
        Some(ColorImage::Rgb(image)) => Some(u64::from(image.pixels[0][0])),
        _ => None,
    }
}

/// Frames and errors in the order in which they came.
fn run(camera: &mut ColorBeside) -> (Vec<Frame>, Vec<(usize, String)>) {
    let (mut frames, mut errors) = (Vec::new(), Vec::new());
    loop {
        match camera.next_frame() {
            Ok(Some(frame)) => frames.push(frame),
            Ok(None) => return (frames, errors),
            Err(error) => errors.push((frames.len(), error.to_string())),
        }
    }
}

#[test]
fn every_depth_frame_has_the_nearest_picture_and_the_webcams_camera() {
    let mut camera = beside(depth_camera(40), webcam(32), false);
    let sensor = camera.rig().sensors[0].clone();
    assert_eq!((sensor.color, sensor.color_from_depth), (Some(calibration().camera), calibration().color_from_depth));
    let (frames, errors) = run(&mut camera);
    assert!(errors.is_empty() && frames.len() == 40);
    for (frame, k) in frames.iter().zip(0..) {
        // Depth is as it was: number, times, values.
        let own = depth_camera(40).frames[k as usize].clone();
        assert_eq!(Frame { color: None, ..frame.clone() }, own);
        let apart = |n: u64| (picture_time(n) - frame.host_time_ns).abs();
        // Of two that are equally near, either will do.
        let nearest = (0..32).map(apart).min().filter(|apart| *apart <= 20 * MS);
        assert_eq!(picture_of(frame).map(apart), nearest, "frame {k}");
    }
    assert!(frames[..38].iter().all(|f| f.color.is_some()));
    // The pictures ended at 1247 ms, the last frame is at 1287 ms.
    assert!(frames[39].color.is_none());
}

#[test]
fn a_webcam_that_fails_is_reported_once_and_depth_goes_on() {
    for is_live in [false, true] {
        let (mut depth, mut color) = (depth_camera(20), webcam(5));
        color.error = Some(CaptureError::Device { device: "webcam".into(), reason: "unplugged".into() });
        depth.pause = Duration::from_millis(u64::from(is_live));
        let (frames, errors) = run(&mut beside(depth, color, is_live));
        assert_eq!((frames.len(), errors.len()), (20, 1), "{errors:?}");
        assert!(errors[0].1.contains("webcam") && errors[0].1.contains("unplugged"));
        // A live depth camera does not wait for a picture that is late.
        let first = picture_of(&frames[0]);
        assert!(first == Some(0) || (is_live && first.is_none()), "{first:?}");
        assert!(frames[19].color.is_none());
    }
}

#[test]
fn a_depth_camera_that_fails_gives_all_its_frames_before_the_error() {
    let mut depth = depth_camera(6);
    depth.error = Some(CaptureError::Device { device: "depth".into(), reason: "unplugged".into() });
    // A live webcam that has sent nothing yet: depth waits for its pictures, but not beyond the end.
    let mut color = webcam(1);
    color.pause = Duration::from_secs(3);
    let (frames, errors) = run(&mut beside(depth, color, true));
    assert_eq!((frames.len(), errors.len(), errors[0].0), (6, 1, 6));
    assert!(frames.iter().zip(0..).all(|(f, k)| f.device_frame == k && f.color.is_none()));
}

#[test]
fn a_live_webcam_and_a_live_depth_camera_pair_as_they_come() {
    let (mut depth, mut color) = (depth_camera(30), webcam(25));
    (depth.pause, color.pause) = (Duration::from_millis(10), Duration::from_millis(10));
    let (frames, errors) = run(&mut beside(depth, color, true));
    assert!(errors.is_empty() && frames.len() == 30);
    for frame in &frames {
        let apart = picture_of(frame).map(|n| (picture_time(n) - frame.host_time_ns).abs());
        assert!(apart.is_none_or(|apart| apart <= 20 * MS), "{apart:?}");
    }
    assert!(frames.iter().filter(|f| f.color.is_some()).count() >= 15);
}

#[test]
fn what_cannot_be_put_together_is_refused_with_what_to_do() {
    let refused = |depth: Script, color: Script| {
        let joined = ColorBeside::new(Box::new(depth), Box::new(color), &calibration(), false);
        joined.err().map(|e| e.to_string()).unwrap_or_default()
    };
    let mut other = webcam(1);
    other.rig.sensors[0].color = Some(PinholeCamera::ideal(8, 6, 5.0, 5.0, 1.0, 1.0));
    let words = refused(depth_camera(1), other);
    assert!(words.contains("8x6") && words.contains("4x3") && words.contains("calibrate"), "{words}");
    let mut two = depth_camera(1);
    two.rig.sensors.push(sensor("second", 30.0, None));
    assert!(refused(two, webcam(1)).contains("2 sensors"));
    assert!(refused(depth_camera(1), depth_camera(1)).contains("no colour"));
}
