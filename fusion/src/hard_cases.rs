//! Cases that are rare on a turntable, found by a review. Each test fails when its mend is taken back.

use std::sync::Arc;

use nalgebra::Vector3;
use toile_capture::{DepthImage, Frame};
use toile_geometry::{Rigid, camera::PinholeCamera};

use crate::{
    DropReason, Fuser, FusionError, FusionSettings, KnownPose, Outcome, Prior, Volume,
    field::{Tsdf, extract_surface, integrate},
    frame::DepthView,
    fuse,
    test_scene::{Memory, Scene, figure_distance, steps},
};

fn settings() -> FusionSettings {
    FusionSettings { voxel_size: 0.008, truncation: 0.03, target_triangles: 20_000, ..FusionSettings::default() }
}

/// The figure before nothing.
fn bare() -> Scene {
    Scene { with_floor: false, with_wall: false, ..Scene::new() }
}

/// A frame of this depth, millimetres by column and row.
fn frame_of(scene: &Scene, index: u64, depth: impl Fn(u32, u32) -> u16) -> Frame {
    let (width, height) = (scene.camera.width, scene.camera.height);
    let values = (0..width * height).map(|i| depth(i % width, i / width)).collect();
    let mut frame = scene.frames(&[None]).remove(0);
    frame.depth = Some(Arc::new(DepthImage { width, height, values }));
    (frame.index, frame.device_time_ns) = (index, 200_000_000 * index as i64);
    frame
}

#[test]
fn a_turn_that_is_fused_whole_stands_upright() {
    let scene = bare();
    // Once with an axis, once with too little of a turn for one.
    for degrees in [6.0, 1.0] {
        let whole = FusionSettings { volume: Volume::All, closing_rounds: 0, refine_rounds: 0, ..settings() };
        let scan = fuse(&mut scene.source(&steps(12, degrees)), &whole, &|_| {}).unwrap();
        let up = scan.trajectory[0].scan_from_camera * -Vector3::y();
        assert!(up.y > 0.98, "{degrees}° a frame: {up:?}");
        let heights = scan.mesh.positions.iter().map(|p| p.y);
        let (low, high) = heights.fold((f32::MAX, f32::MIN), |(low, high), y| (low.min(y), high.max(y)));
        assert!(low.abs() < 0.02 && (high - 1.71).abs() < 0.08, "{low} {high}");
    }
}

#[test]
fn a_camera_on_its_side_or_upside_down_gives_an_upright_scan() {
    use crate::ImageSide::{Bottom, Left, Right};
    for (quarters, side) in [(1.0, Left), (2.0, Bottom), (3.0, Right)] {
        let upright = Scene::new();
        let roll =
            nalgebra::UnitQuaternion::from_axis_angle(&Vector3::z_axis(), quarters * std::f64::consts::FRAC_PI_2);
        let scene = Scene { room_from_camera: upright.room_from_camera * roll, ..upright };
        let scan = fuse(&mut scene.source(&steps(36, 10.0)), &settings(), &|_| {}).unwrap();
        let volume = scan.report.volume.as_ref().unwrap();
        assert!(volume.floor_found && volume.image_up == side, "{volume:?}");
        let heights = scan.mesh.positions.iter().map(|p| p.y);
        let (low, high) = heights.fold((f32::MAX, f32::MIN), |(low, high), y| (low.min(y), high.max(y)));
        assert!(low.abs() < 0.02 && (high - 1.71).abs() < 0.08, "{side:?}: from {low} to {high}");
        let radius = scan.mesh.positions.iter().map(|p| p.x.hypot(p.z)).fold(0.0, f32::max);
        assert!(radius < 0.7, "{side:?}: something {radius} m from the axis");
    }
}

#[test]
fn a_few_views_in_uneven_steps_are_all_used_and_go_round() {
    for stops in [
        vec![0.0, 45.0, 90.0, 135.0, 180.0, 225.0, 270.0, 315.0],
        vec![0.0, 38.0, 62.0, 110.0, 150.0, 171.0, 219.0, 260.0, 301.0, 338.0],
    ] {
        let scene = Scene::new();
        let angles: Vec<Option<f64>> = stops.iter().map(|d: &f64| Some(d.to_radians())).collect();
        let scan = fuse(&mut scene.source(&angles), &settings(), &|_| {}).unwrap();
        assert!(scan.report.dropped.is_empty(), "{:?}", scan.report.dropped);
        let turned = stops[stops.len() - 1];
        assert!((scan.report.turned_deg - turned).abs() < 1.0, "{} of {turned}°", scan.report.turned_deg);
        assert!(scan.report.full_turn);
        for (k, angle) in angles.iter().enumerate() {
            let truth = scene.figure_from_camera(0.0).inverse() * scene.figure_from_camera(angle.unwrap());
            let found = scan.trajectory[0].scan_from_camera.inverse() * scan.trajectory[k].scan_from_camera;
            let off = found.rotation.angle_to(&truth.rotation).to_degrees();
            assert!(off < 0.6, "view {k} is {off}° off");
        }
    }
}

#[test]
fn known_poses_fill_soles_where_they_are_and_not_at_their_frames_zero() {
    let (scene, angles) = (Scene::new(), steps(12, 30.0));
    let raised = Rigid::translation(0.0, -0.8, 0.0);
    let pose = |i: usize| KnownPose {
        device_time_ns: 200_000_000 * i as i64,
        scan_from_camera: raised * scene.figure_from_camera(angles[i].unwrap()),
    };
    let settings = FusionSettings { poses: Some((0..12).map(pose).collect()), ..settings() };
    let scan = fuse(&mut scene.source(&angles), &settings, &|_| {}).unwrap();
    let off = |p: &nalgebra::Point3<f32>| figure_distance(&(raised.inverse() * p.cast::<f64>())).abs();
    let filled = scan.mesh.positions.iter().zip(&scan.mesh.attributes["filled"]).filter(|(_, mark)| **mark == 1.0);
    let worst = filled.map(|(p, _)| off(p)).fold(0.0, f64::max);
    assert!(worst > 0.0 && worst < 0.06, "{worst} m");
}

#[test]
fn a_hand_held_camera_that_was_lost_for_long_is_found_at_a_place_it_has_seen() {
    let scene = bare();
    let hand_held = FusionSettings { volume: Volume::All, prior: Prior::None, ..settings() };
    let mut fuser = Fuser::new(&scene.rig(), None, hand_held).unwrap();
    let mut frames = scene.frames(&steps(10, 6.0));
    // It looks at a wall for five frames, and is back where it was six frames before that.
    frames.extend((10..15).map(|k| frame_of(&scene, k, |u, v| 1500 + (2 * u + v) as u16)));
    frames.push(Frame { index: 15, device_time_ns: 3_000_000_000, ..frames[4].clone() });
    let reported: Vec<bool> = frames.iter().map(|f| matches!(fuser.push(f).unwrap(), Outcome::Fused { .. })).collect();
    assert_eq!(reported, [vec![true; 10], vec![false; 5], vec![true]].concat());
    let off = fuser.kept.frames[10].model_from_camera.inverse() * fuser.kept.frames[4].model_from_camera;
    assert!(off.translation.vector.norm() < 0.01 && off.rotation.angle() < 0.01, "{off}");
}

#[test]
fn a_take_does_not_begin_with_a_frame_without_surface() {
    let scene = bare();
    let speckles = |k| frame_of(&scene, k, |u, v| if u % 5 == 0 && v % 5 == 0 { 900 } else { 0 });
    let whole = FusionSettings { volume: Volume::All, closing_rounds: 0, refine_rounds: 0, ..settings() };
    let mut frames: Vec<Frame> = (0..2).map(speckles).collect();
    frames.extend(scene.frames(&steps(10, 6.0)).into_iter().map(|f| Frame {
        index: f.index + 2,
        device_time_ns: f.device_time_ns + 400_000_000,
        ..f
    }));
    let scan = fuse(&mut Memory { rig: scene.rig(), frames, next: 0 }, &whole, &|_| {}).unwrap();
    assert_eq!(scan.report.dropped.iter().map(|d| d.index).collect::<Vec<_>>(), [0, 1]);
    assert_eq!(scan.report.dropped[0].reason, DropReason::TooLittleSurface);
    // And one that has no other frames says so.
    let frames = (0..4).map(speckles).collect();
    let error = fuse(&mut Memory { rig: scene.rig(), frames, next: 0 }, &whole, &|_| {}).unwrap_err();
    assert!(error.to_string().contains("too little surface"), "{error}");
}

/// A floor far away and nearly edge-on, seen once: too little weight for a surface.
#[test]
fn frames_that_make_no_surface_are_an_error_and_no_empty_scan() {
    let scene = bare();
    let floor = |_, v: u32| 1500.0 / ((f64::from(v) - 76.0) / 150.0).max(0.01);
    let grazing = |u, v| if (4000.0..8900.0).contains(&floor(u, v)) { floor(u, v) as u16 } else { 0 };
    let whole = FusionSettings { volume: Volume::All, prior: Prior::None, max_depth: 9.0, ..settings() };
    let frames = vec![frame_of(&scene, 0, grazing)];
    let error = fuse(&mut Memory { rig: scene.rig(), frames, next: 0 }, &whole, &|_| {}).map(drop).unwrap_err();
    assert!(matches!(error, FusionError::NobodyInIt { .. }), "{error}");
    assert!(error.to_string().contains("no surface"), "{error}");
}

/// Far surfaces must not fall between samples whose spacing suits near ones.
#[test]
fn a_far_wall_beside_much_that_is_near_has_no_gaps() {
    let camera = PinholeCamera::ideal(240, 180, 150.0, 150.0, 119.5, 89.5);
    let depth: Vec<f32> = (0..240 * 180).map(|i| if i % 240 < 160 { 0.7 } else { 5.5 }).collect();
    let view = DepthView::new(&camera, &depth, 2);
    let mut field = Tsdf::new(0.008, 0.024, false);
    integrate(&mut field, &view, &Rigid::identity()).unwrap();
    let mesh = extract_surface(&field, 1);
    let far = |t: &usize| mesh.corners(*t).iter().all(|p| p.z > 5.0);
    let area = |t: usize| {
        let [a, b, c] = mesh.corners(t);
        0.5 * f64::from((b - a).cross(&(c - a)).norm())
    };
    let sum: f64 = (0..mesh.triangles.len()).filter(far).map(area).sum();
    let truth = 80.0 * 180.0 * (5.5_f64 / 150.0).powi(2);
    assert!(sum > 0.93 * truth && sum < 1.03 * truth, "{sum} of {truth} m²");
}

/// Blocks nearly as large as their distance: inverse depths do not follow from the centre's there.
#[test]
fn a_slanted_wall_as_near_as_its_blocks_are_long_lies_where_it_is() {
    let camera = PinholeCamera::ideal(160, 120, 110.0, 110.0, 79.5, 59.5);
    let depth = |i: usize| (1.35 / (1.0 - 0.4 * ((i % 160) as f64 - 79.5) / 110.0)) as f32;
    let view = DepthView::new(&camera, &(0..160 * 120).map(depth).collect::<Vec<_>>(), 2);
    let mut field = Tsdf::new(0.05, 0.1, false);
    integrate(&mut field, &view, &Rigid::identity()).unwrap();
    let mesh = extract_surface(&field, 1);
    let off = |p: &nalgebra::Point3<f32>| (p.z - 0.4 * p.x - 1.35).abs() / 1.16f32.sqrt();
    let worst = mesh.positions.iter().map(off).fold(0.0, f32::max);
    assert!(mesh.positions.len() > 500 && worst < 1e-3, "{} positions, {worst} m off", mesh.positions.len());
}

#[test]
fn places_too_far_for_their_digits_are_refused_or_fused_but_never_a_panic() {
    let camera = PinholeCamera::ideal(80, 60, 60.0, 60.0, 39.5, 29.5);
    let view = DepthView::new(&camera, &vec![1.5; 80 * 60], 2);
    for digits in 2..12 {
        let far = Rigid::translation(10f64.powi(digits), -3.3 * 10f64.powi(digits), 0.7);
        let mut field = Tsdf::new(0.004, 0.016, false);
        drop(integrate(&mut field, &view, &far));
    }
}

/// Noise of 12 mm in blotches, with a band that suits 7: what is cut of it on one side alone makes the subject thin.
#[test]
fn noise_that_is_wide_against_the_band_neither_thins_the_subject_nor_stays_unsaid() {
    let scene = Scene { blotches: 0.021, ..Scene::new() };
    let scan = fuse(&mut scene.source(&steps(60, 6.0)), &settings(), &|_| {}).unwrap();
    let report = &scan.report;
    assert!((5.0..20.0).contains(&report.noise_widest_mm), "{}", report.noise_widest_mm);
    assert!(report.noise_correlation.abs() < 0.3, "{}", report.noise_correlation);
    assert!(report.warnings.iter().any(|w| w.contains("depth is noisy")), "{:?}", report.warnings);
    let figure_from_scan = scene.figure_from_camera(0.0) * scan.trajectory[0].scan_from_camera.inverse();
    let seen = scan.mesh.positions.iter().zip(&scan.mesh.attributes["filled"]).filter(|(_, filled)| **filled == 0.0);
    let mut off: Vec<f64> = seen.map(|(p, _)| figure_distance(&(figure_from_scan * p.cast::<f64>()))).collect();
    let bias = toile_geometry::statistics::median(&mut off).unwrap();
    assert!(bias.abs() < 0.0018, "{bias} m");
}

#[test]
fn a_known_height_sets_the_scale_and_one_of_something_else_does_not() {
    let scene = Scene::new();
    let mut rig = scene.rig();
    rig.sensors[0].depth_scale *= 1.01;
    let frames = scene.frames(&steps(12, 30.0));
    let with = |known_height: f64| {
        let mut source = Memory { rig: rig.clone(), frames: frames.clone(), next: 0 };
        fuse(&mut source, &FusionSettings { known_height, ..settings() }, &|_| {}).unwrap()
    };
    let (told, foreign, untold) = (with(1.705), with(1.2), with(0.0));
    let height = |scan: &crate::Scan| scan.mesh.positions.iter().map(|p| p.y).fold(0.0, f32::max);
    assert!((height(&told) - 1.705).abs() < 1e-4, "{}", height(&told));
    assert!((told.report.scaled_by * f64::from(height(&untold)) - 1.705).abs() < 1e-4, "{}", told.report.scaled_by);
    assert!((0.985..0.999).contains(&told.report.scaled_by), "{}", told.report.scaled_by);
    assert!(told.report.warnings.iter().any(|w| w.contains("too long")), "{:?}", told.report.warnings);
    let reach = |scan: &crate::Scan| scan.trajectory[3].scan_from_camera.translation.vector.norm();
    assert!((reach(&told) / reach(&untold) - told.report.scaled_by).abs() < 1e-9);
    assert!(
        foreign.report.warnings.iter().any(|w| w.contains("not of the same thing")),
        "{:?}",
        foreign.report.warnings
    );
    assert_eq!((foreign.report.scaled_by, height(&foreign)), (1.0, height(&untold)));
}
