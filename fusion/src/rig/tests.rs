//! Two sensors before the same figure: truth for the rig.

use nalgebra::{Isometry3, Vector3};
use toile_capture::{Frame, Rig};
use toile_geometry::Rigid;

use crate::{
    FusionReport, FusionSettings, fuse,
    report::SensorReport,
    test_scene::{Memory, Scene, steps},
};

/// Frames of each sensor.
const FRAMES: usize = 42;
/// Degrees from a frame to the next.
const STEP: f64 = 9.0;
/// What the second sensor's clock shows when the first one's shows 0, nanoseconds.
const EPOCH_NS: i64 = 77_000_000_000;

fn scene() -> Scene {
    Scene { with_wall: false, with_color: false, ..Scene::new() }
}

/// The second sensor stands a third of the way around.
fn second() -> Scene {
    let around = Isometry3::rotation(Vector3::y() * 2.1);
    Scene { room_from_camera: around * scene().room_from_camera, ..scene() }
}

/// Where the second sensor stands in the frame of the first.
fn true_place() -> Rigid {
    scene().room_from_camera.inverse() * second().room_from_camera
}

/// Both sensors' frames; the second one's place is recorded as `recorded`, it is pushed by `push` in the middle of the take.
fn both(recorded: Rigid, push: &Rigid) -> Memory {
    let (first, second) = (scene(), second());
    let mut rig = Rig { sensors: vec![first.rig().sensors[0].clone(), second.rig().sensors[0].clone()] };
    rig.sensors[1].name = "side".into();
    rig.sensors[1].rig_from_depth = recorded;
    let late: Vec<Option<f64>> = steps(FRAMES, STEP).iter().map(|a| a.map(|a| a + (0.5 * STEP).to_radians())).collect();
    let still = second.frames(&late[..FRAMES / 2]);
    let pushed = Scene { room_from_camera: second.room_from_camera * push, ..second }.frames(&late);
    let seen = still.into_iter().chain(pushed.into_iter().skip(FRAMES / 2));
    let mut frames: Vec<Frame> = Vec::new();
    for (a, mut b) in first.frames(&steps(FRAMES, STEP)).into_iter().zip(seen) {
        b.sensor = 1;
        b.host_time_ns += 100_000_000;
        b.device_time_ns = b.host_time_ns + EPOCH_NS;
        frames.extend([a, b]);
    }
    frames.iter_mut().enumerate().for_each(|(i, f)| f.index = i as u64);
    Memory { rig, frames, next: 0 }
}

fn report_of(mut source: Memory) -> FusionReport {
    let settings = FusionSettings { voxel_size: 0.012, truncation: 0.04, ..FusionSettings::default() };
    fuse(&mut source, &settings, &|_| {}).expect("a figure turns before both").report
}

/// How far a place is from the truth, metres and degrees.
fn error(found: &SensorReport) -> (f64, f64) {
    let rotation = Vector3::from(found.rotation_deg).map(f64::to_radians);
    let off = Rigid::new(found.position_m.into(), rotation).inverse() * true_place();
    (off.translation.vector.norm(), off.rotation.angle().to_degrees())
}

fn misplaced() -> Rigid {
    true_place() * Rigid::new(Vector3::new(0.012, -0.01, 0.012), Vector3::new(0.01, -0.01, 0.01))
}

#[test]
fn a_second_sensor_is_placed_from_the_data_and_all_its_frames_are_fused() {
    let report = report_of(both(misplaced(), &Rigid::identity()));
    let [first, side] = &report.sensors[..] else { panic!("{:?}", report.sensors) };
    assert_eq!((first.frames_fused, side.frames_fused, side.frames_seen), (FRAMES, FRAMES, FRAMES));
    let (shift, angle) = error(side);
    // Half a pixel of this small camera is 8 mm at the figure; some 80 000 points in 42 frames average that.
    assert!(shift < 0.003 && angle < 0.1, "{shift} m, {angle}°");
    assert!((side.departs_mm - 19.7).abs() < 4.0 && (side.departs_deg - 1.0).abs() < 0.2, "{side:?}");
    assert_eq!((side.moved, &report.warnings[..]), (None, &[][..]));
}

#[test]
fn a_sensor_that_stands_anywhere_is_found_and_that_is_said() {
    let report = report_of(both(Rigid::identity(), &Rigid::identity()));
    let (shift, angle) = error(&report.sensors[1]);
    assert!(shift < 0.003 && angle < 0.1, "{shift} m, {angle}°");
    assert_eq!(report.frames_fused, 2 * FRAMES);
    assert!(report.warnings.iter().any(|w| w.contains("`side` stands") && w.contains("toile calibrate")));
}

#[test]
fn a_sensor_that_is_knocked_is_followed_and_that_is_said() {
    let push = Rigid::new(Vector3::new(0.02, 0.0, 0.01), Vector3::new(0.02, 0.03, 0.0));
    let report = report_of(both(misplaced(), &push));
    assert_eq!(report.frames_fused, 2 * FRAMES);
    let moved = report.sensors[1].moved.expect("it was pushed");
    assert!((moved.shift_mm - 22.4).abs() < 6.0 && (moved.angle_deg - 2.07).abs() < 0.3, "{moved:?}");
    assert!((moved.after_s - 0.2 * (FRAMES / 2) as f64).abs() < 0.3, "{moved:?}");
    assert!(report.warnings.iter().any(|w| w.contains("knocked")), "{:?}", report.warnings);
}

#[test]
fn a_sensor_of_which_nothing_fits_is_left_out_and_that_is_said() {
    let mut source = both(misplaced(), &Rigid::identity());
    let alone = scene().frames(&[None]).remove(0);
    for frame in source.frames.iter_mut().filter(|f| f.sensor == 1) {
        frame.depth.clone_from(&alone.depth);
    }
    let report = report_of(source);
    assert_eq!(report.sensors_not_used, ["side"]);
    assert_eq!(report.frames_fused, FRAMES);
    assert!(report.warnings.iter().any(|w| w.contains("`side`")), "{:?}", report.warnings);
}
