//! Recordings that other people's libraries made (`tests/data/make_mcap.py`): the Python packages `mcap` and
//! `foxglove-schemas-protobuf`. The expected frames are the script's formulas, and none of our code wrote them.
#![allow(clippy::unwrap_used)]

mod common;

use std::path::{Path, PathBuf};

use common::all_frames;
use toile_capture::{CaptureError, ColorImage, Frame, Replay, Source, inspect};
use toile_geometry::camera::PinholeCamera;

const WIDTH: u32 = 32;
const HEIGHT: u32 = 24;
const START_NS: i64 = 1_700_000_000_100_000_000;
const STEP_NS: i64 = 100_000_000;

fn golden(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn open(name: &str) -> (Replay, Vec<Frame>) {
    let mut replay = Replay::open(&golden(name)).unwrap();
    let frames = all_frames(&mut replay).unwrap();
    (replay, frames)
}

/// The script's `depth`, of frame `i`.
fn check_depth(frame: &Frame, i: u32) {
    let depth = frame.depth.as_ref().expect("every frame has depth");
    assert_eq!((depth.width, depth.height), (WIDTH, HEIGHT));
    for (v, u) in (0..HEIGHT).flat_map(|v| (0..WIDTH).map(move |u| (v, u))) {
        let expected = if (u + v + i).is_multiple_of(11) { 0 } else { 1000 + 10 * i + 3 * u + 7 * v };
        assert_eq!(u32::from(depth.at(u, v)), expected, "frame {i}, pixel {u}, {v}");
    }
}

/// The script's `jpeg`: one colour all over, but for what JPEG loses.
fn check_color(color: &ColorImage, i: u32) {
    let image = color.decode(0).unwrap();
    assert_eq!((image.width, image.height), (WIDTH, HEIGHT));
    let near = |a: u8, b: u32| u32::from(a).abs_diff(b) <= 4;
    assert!(image.pixels.iter().all(|p| near(p[0], 40 * i) && near(p[1], 80) && near(p[2], 200)), "frame {i}");
}

fn camera() -> PinholeCamera {
    PinholeCamera::ideal(WIDTH, HEIGHT, 30.5, 30.5, 15.5, 11.5)
}

#[test]
fn a_recording_written_from_our_documentation_is_read() {
    let (replay, frames) = open("toile-recording.mcap");
    assert_eq!((replay.lost(), replay.rig().sensors.len()), (None, 2));
    for (n, sensor) in replay.rig().sensors.iter().enumerate() {
        assert_eq!((sensor.depth, sensor.color, sensor.identity.model.as_str()), (camera(), Some(camera()), "python"));
        assert_eq!(sensor.rig_from_depth.translation.vector.x, 0.5 * n as f64);
    }
    assert_eq!(frames.len(), 6);
    for (i, frame) in frames.iter().enumerate() {
        let time = START_NS + i as i64 * STEP_NS;
        assert_eq!((frame.sensor, frame.index, frame.device_frame), (i % 2, i as u64, 40 + i as u64));
        assert_eq!((frame.device_time_ns, frame.host_time_ns), (time, time + 5_000_000));
        assert_eq!(frame.lost_before, u32::from(i == 4));
        check_depth(frame, i as u32);
        check_color(frame.color.as_ref().unwrap(), i as u32);
    }
}

#[test]
fn depth_and_colour_of_another_program_are_paired_by_time() {
    let (replay, frames) = open("foxglove-raw.mcap");
    let sensor = &replay.rig().sensors[0];
    let camera = PinholeCamera { distortion: [0.01, -0.02, 0.001, 0.002, 0.003], ..camera() };
    assert_eq!((replay.lost(), sensor.depth, sensor.color), (None, camera, Some(camera)));
    assert_eq!((sensor.depth_scale, sensor.fps), (0.001, 10.0));
    assert_eq!(frames.len(), 6);
    for (i, frame) in frames.iter().enumerate() {
        assert_eq!(frame.device_time_ns, START_NS + i as i64 * STEP_NS);
        check_depth(frame, i as u32);
        assert_eq!(frame.color.is_some(), i != 3);
        if let Some(color) = &frame.color {
            check_color(color, i as u32);
        }
    }
    let found = inspect(&golden("foxglove-raw.mcap")).unwrap();
    assert!(found.to_string().contains("1 frames have no colour: 3") && !found.data_lost, "{found}");
}

#[test]
fn depth_as_png_without_chunks_is_read() {
    let (replay, frames) = open("foxglove-png.mcap");
    let sensor = &replay.rig().sensors[0];
    assert_eq!((replay.lost(), sensor.color, sensor.depth.fx), (None, None, 30.5));
    assert_eq!(frames.len(), 6);
    (0..).zip(&frames).for_each(|(i, frame)| check_depth(frame, i));
}

/// Bytes all over each file changed, one at a time: never a panic, and depth that the chunk's checksum covers never
/// changes silently.
#[test]
fn damage_never_panics() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path().join("damaged.mcap");
    for name in ["toile-recording.mcap", "foxglove-raw.mcap"] {
        let bytes = std::fs::read(golden(name)).unwrap();
        let whole = open(name).1;
        for at in (0..bytes.len()).step_by(11) {
            let mut damaged = bytes.clone();
            damaged[at] ^= 0x41;
            std::fs::write(&path, &damaged).unwrap();
            let read = || -> Result<(Vec<Frame>, bool), CaptureError> {
                let mut replay = Replay::open(&path)?;
                Ok((all_frames(&mut replay)?, replay.lost().is_some()))
            };
            // These writers leave out the checksum over all data, so the heads of chunks are not covered.
            if let Ok((frames, false)) = read() {
                let same = |frame: &Frame| whole.iter().any(|w| w.depth == frame.depth);
                assert!(frames.iter().all(same), "{name}, byte {at}: silent damage");
            }
        }
    }
}
