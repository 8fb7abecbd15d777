//! The rig keeps the promises of sources, and its depth is that of the scene.
#![allow(clippy::unwrap_used)] // helpers of tests are not seen as tests

mod scene;

use std::{collections::VecDeque, sync::Arc};

use nalgebra::{Matrix3, Point3, Vector2, Vector3};
use toile_capture::{ColorImage, Frame, RgbImage, Source};
use toile_driver_stereo::{
    Cameras, PairCounts, Pairs, Picture, Pictures, Side, SideBySide, StereoCamera, StereoDriverError, StereoSettings,
    TwoCameras, TwoSensors,
};
use toile_driver_transport::{
    TransportError,
    simulated::{SimulatedBus, SimulatedVideo},
};
use toile_stereo::DepthSettings;

/// Nanoseconds a frame.
const PERIOD: i64 = 33_000_000;

/// The next answer of a scripted camera: the picture with this number, a torn one, or nothing any more.
enum Event {
    Picture(u64),
    Torn(u64),
    Unplugged,
}

/// A camera in memory: its pictures come at `sequence` periods, `late` behind.
struct Script {
    side: Side,
    image: Arc<RgbImage>,
    events: VecDeque<Event>,
    late: i64,
    is_live: bool,
}

impl Pictures for Script {
    fn next_picture(&mut self) -> Result<Option<Picture>, StereoDriverError> {
        Ok(match self.events.pop_front() {
            None => None,
            Some(Event::Unplugged) => return Err(TransportError::Unplugged.into()),
            Some(Event::Torn(sequence)) => {
                let reason = "is torn".to_string();
                return Err(StereoDriverError::Picture { side: self.side, sequence, reason });
            }
            Some(Event::Picture(sequence)) => {
                let time_ns = sequence as i64 * PERIOD + self.late;
                Some(Picture { image: self.image.clone(), sequence, time_ns, host_time_ns: time_ns + 5 })
            }
        })
    }

    fn is_live(&self) -> bool {
        self.is_live
    }
}

fn script(side: Side, image: Arc<RgbImage>, numbers: &[u64]) -> Script {
    let events = numbers.iter().map(|&n| Event::Picture(n)).collect();
    Script { side, image, events, late: if side == Side::Left { 0 } else { 4_000_000 }, is_live: true }
}

fn settings() -> StereoSettings {
    StereoSettings {
        name: "pair".into(),
        cameras: Cameras::Folder { path: "unused".into() },
        width: scene::SIZE.0,
        height: scene::SIZE.1,
        fps: 1e9 / PERIOD as f64,
        calibration: Vec::new(),
        metres_per_unit: 1.0,
        alpha: 0.0,
        depth: DepthSettings { near: 0.8, far: 3.0, ..DepthSettings::default() },
    }
}

fn camera(pairs: impl Pairs + 'static) -> StereoCamera {
    StereoCamera::new(Box::new(pairs), &scene::calibration(), &settings()).unwrap()
}

fn two(left: &[u64], right: &[u64]) -> TwoCameras<Script, Script> {
    let (l, r) = scene::pictures();
    TwoCameras::new(script(Side::Left, l, left), script(Side::Right, r, right), settings().fps)
}

fn all(camera: &mut StereoCamera) -> Vec<Frame> {
    std::iter::from_fn(|| camera.next_frame().unwrap()).collect()
}

/// Errors of a frame's depth in pixels of disparity: what sub-pixel matching is measured in.
fn disparity_errors(camera: &StereoCamera, frame: &Frame) -> (f64, Vec<f64>) {
    let (depth, sensor) = (frame.depth.as_ref().unwrap(), &camera.rig().sensors[0]);
    let made = camera.depth().rectification();
    let (c, focal_baseline) = (sensor.depth, made.camera.fx * made.baseline);
    let mut errors = Vec::new();
    for (i, &value) in depth.values.iter().enumerate().filter(|(_, value)| **value > 0) {
        let (u, v) = ((i % c.width as usize) as f64, (i / c.width as usize) as f64);
        let ray = Vector2::new((u - c.cx) / c.fx, (v - c.cy) / c.fy);
        let truth = true_depth(&made.left.rectified_from_camera, ray);
        errors.push((focal_baseline / (f64::from(value) * sensor.depth_scale) - focal_baseline / truth).abs());
    }
    errors.sort_by(f64::total_cmp);
    (errors.len() as f64 / depth.values.len() as f64, errors)
}

#[test]
fn depth_is_that_of_the_scene_within_a_fraction_of_a_pixel() {
    let mut camera = camera(two(&[0], &[0]));
    let frame = camera.next_frame().unwrap().unwrap();
    let (density, errors) = disparity_errors(&camera, &frame);
    let at = |share: f64| errors[(errors.len() as f64 * share) as usize];
    println!("{density:.3} answered; disparity off by {:.3} px (median), {:.3} px (95 %)", at(0.5), at(0.95));
    if let Ok(path) = std::env::var("TOILE_DRAW") {
        draw(&path, &frame);
    }
    // A tenth of a pixel is what census matching reaches on textured surfaces; around the ball it answers with either side.
    assert!(density > 0.75, "{density}");
    assert!(at(0.5) < 0.1 && at(0.95) < 0.5, "{} {}", at(0.5), at(0.95));
}

/// Depth from near (bright) to far, for the eye.
fn draw(path: &str, frame: &Frame) {
    let depth = frame.depth.as_ref().unwrap();
    let gray = depth.values.iter().map(|&v| if v == 0 { 0 } else { 255 - (f64::from(v) / 30_000.0 * 255.0) as u8 });
    image::GrayImage::from_raw(depth.width, depth.height, gray.collect()).unwrap().save(path).unwrap();
}

#[test]
fn a_side_by_side_camera_gives_the_same_frame_as_two_cameras() {
    let (l, r) = scene::pictures();
    let rows = l.pixels.chunks_exact(SIZE_W).zip(r.pixels.chunks_exact(SIZE_W));
    let pixels = rows.flat_map(|(a, b)| a.iter().chain(b)).copied().collect();
    let both = Arc::new(RgbImage { width: 2 * l.width, height: l.height, pixels });
    let mut one = camera(SideBySide::new(script(Side::Left, both, &[7])));
    let mut pair = camera(two(&[7], &[7]));
    assert_eq!(one.next_frame().unwrap().unwrap(), pair.next_frame().unwrap().unwrap());
    assert!(one.next_frame().unwrap().is_none());
    let odd = Arc::new(RgbImage { width: 3, height: 1, pixels: vec![[0; 3]; 3] });
    let error = camera(SideBySide::new(script(Side::Left, odd, &[2]))).next_frame().unwrap_err().to_string();
    assert!(error.contains("picture 2") && error.contains("3 pixels wide"), "{error}");
}

const SIZE_W: usize = scene::SIZE.0 as usize;

#[test]
fn unpaired_pictures_are_delivered_or_counted_and_losses_are_reported() {
    let mut camera = camera(two(&[0, 1, 2, 5], &[0, 2, 3, 5]));
    let frames = all(&mut camera);
    let seen: Vec<_> = frames.iter().map(|f| (f.index, f.device_frame, f.lost_before, f.depth.is_some())).collect();
    assert_eq!(seen, [(0, 0, 0, true), (1, 1, 0, false), (2, 2, 0, true), (3, 5, 2, true)]);
    assert!(frames.iter().all(|f| f.color.is_some() && f.device_time_ns == f.device_frame as i64 * PERIOD));
    assert_eq!(camera.counts(), PairCounts { paired: 3, left_alone: 1, right_alone: 1, torn: 0 });
}

#[test]
fn a_torn_picture_and_one_of_another_size_are_named_and_the_next_pair_goes_on() {
    let (l, r) = scene::pictures();
    let mut left = script(Side::Left, l, &[0, 2]);
    left.events.insert(1, Event::Torn(1));
    let cameras = TwoCameras::new(left, script(Side::Right, r, &[0, 1, 2]), settings().fps);
    let mut rig = camera(cameras);
    assert!(rig.next_frame().unwrap().unwrap().depth.is_some());
    let error = rig.next_frame().unwrap_err().to_string();
    assert!(error.contains("left camera's picture 1 is torn"), "{error}");
    let next = rig.next_frame().unwrap().unwrap();
    assert_eq!((next.device_frame, next.lost_before, next.depth.is_some()), (2, 1, true));
    assert_eq!(rig.counts(), PairCounts { paired: 2, left_alone: 0, right_alone: 1, torn: 1 });

    let small = Arc::new(RgbImage { width: 4, height: 2, pixels: vec![[0; 3]; 8] });
    let (l, _) = scene::pictures();
    let wrong = TwoCameras::new(script(Side::Left, l, &[0]), script(Side::Right, small, &[0]), 30.0);
    let error = camera(wrong).next_frame().unwrap_err().to_string();
    assert!(error.contains("frame 0") && error.contains("(4, 2, 8)"), "{error}");
}

#[test]
fn an_unplugged_camera_ends_the_take() {
    let (l, r) = scene::pictures();
    let (mut left, right) = (script(Side::Left, l, &[0, 1]), script(Side::Right, r, &[0, 1, 2, 3, 4, 5, 6, 7]));
    left.events.push_back(Event::Unplugged);
    let mut rig = camera(TwoCameras::new(left, right, settings().fps));
    assert!((0..2).all(|_| rig.next_frame().unwrap().is_some()));
    assert!(rig.next_frame().unwrap_err().to_string().contains("unplugged"));
    assert!(rig.next_frame().unwrap().is_none());
}

#[test]
fn folders_of_pictures_and_recordings_of_two_sensors_are_rigs_too() {
    let (l, r) = scene::pictures();
    let folder = tempfile::tempdir().unwrap();
    for (side, image) in [("left", &l), ("right", &r)] {
        for number in [3, 4] {
            let flat = image.pixels.as_flattened().to_vec();
            let picture = image::RgbImage::from_raw(image.width, image.height, flat).unwrap();
            picture.save(folder.path().join(format!("{side}{number:02}.png"))).unwrap();
        }
    }
    std::fs::write(folder.path().join("left05.png"), b"no picture").unwrap();
    let calibration = folder.path().join("rig.yml");
    std::fs::write(&calibration, calibration_text()).unwrap();
    let cameras = Cameras::Folder { path: folder.path().into() };
    let chosen = StereoSettings { cameras, calibration: vec![calibration], ..settings() };
    let mut rig = StereoCamera::open(&SimulatedVideo::new(SimulatedBus::default()), &chosen).unwrap();
    let from_folder = [rig.next_frame().unwrap().unwrap(), rig.next_frame().unwrap().unwrap()];
    assert!(from_folder.iter().all(|f| f.depth.is_some()));
    let error = rig.next_frame().unwrap_err().to_string();
    assert!(error.contains("left camera's picture 5") && error.contains("left05.png"), "{error}");
    assert!(rig.next_frame().unwrap().is_none());

    let mut recorded = camera(TwoSensors::new(Recorded::new(&l, &r), chosen.fps));
    let from_recording = all(&mut recorded);
    assert_eq!(from_recording.len(), 2);
    assert_eq!(from_recording[0].depth, from_folder[0].depth);
    assert_eq!(recorded.counts(), PairCounts { paired: 2, left_alone: 0, right_alone: 0, torn: 0 });
}

/// Two sensors' colour frames, as a replay gives them.
struct Recorded {
    rig: toile_capture::Rig,
    frames: VecDeque<Frame>,
}

impl Recorded {
    fn new(left: &Arc<RgbImage>, right: &Arc<RgbImage>) -> Self {
        let frame = |k: u64| Frame {
            sensor: (k % 2) as usize,
            index: k,
            device_frame: k / 2,
            lost_before: 0,
            device_time_ns: (k / 2) as i64 * PERIOD,
            host_time_ns: 0,
            depth: None,
            color: Some(ColorImage::Rgb(if k.is_multiple_of(2) { left.clone() } else { right.clone() })),
        };
        Self { rig: toile_capture::Rig::default(), frames: (0..4).map(frame).collect() }
    }
}

impl Source for Recorded {
    fn rig(&self) -> &toile_capture::Rig {
        &self.rig
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, toile_capture::CaptureError> {
        Ok(self.frames.pop_front())
    }
}

/// The scene's calibration as OpenCV would write it.
fn calibration_text() -> String {
    let c = scene::calibration();
    let matrix = |name: &str, rows: usize, data: &[f64]| {
        let list: Vec<String> = data.iter().map(|x| format!("{x:e}")).collect();
        let cols = data.len() / rows;
        format!(
            "{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {cols}\n   dt: d\n   data: [ {} ]\n",
            list.join(", ")
        )
    };
    let mut text = "%YAML:1.0\n---\n".to_string();
    for (k, lens) in [(1, c.left), (2, c.right)] {
        text += &matrix(&format!("M{k}"), 3, &[lens.fx, 0.0, lens.cx, 0.0, lens.fy, lens.cy, 0.0, 0.0, 1.0]);
        text += &matrix(&format!("D{k}"), 1, &lens.distortion);
    }
    let rotation = c.right_from_left.rotation.to_rotation_matrix();
    text += &matrix("R", 3, rotation.matrix().transpose().as_slice());
    text + &matrix("T", 3, c.right_from_left.translation.vector.as_slice())
}

/// Depth in the rectified frame of the rectified ray (x, y, 1).
fn true_depth(rectified_from_left: &Matrix3<f64>, ray: Vector2<f64>) -> f64 {
    let direction = rectified_from_left.transpose() * Vector3::new(ray.x, ray.y, 1.0);
    (rectified_from_left * scene::hit(Point3::origin(), direction).coords).z
}

#[test]
fn settings_of_impossible_size_are_refused() {
    let video = SimulatedVideo::new(SimulatedBus::default());
    let chosen = StereoSettings { width: u32::MAX, ..settings() };
    let error = StereoCamera::open(&video, &chosen).err().map(|e| e.to_string()).unwrap_or_default();
    assert!(error.contains("4294967295") && error.contains("one view"), "{error}");
}
