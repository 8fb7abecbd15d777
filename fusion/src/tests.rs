//! Tests of the whole stage on a scene with known truth.

use nalgebra::Point3;
use toile_geometry::{Rigid, ply, topology::Edges};

use crate::{
    DropReason, FusionError, FusionSettings, ImageSide, KnownPose, Outcome, Prior, Scan, SubjectVolume, Volume,
    field::{Tsdf, VOXELS, extract_surface, integrate, ray_cast},
    finish::{close, minimum_weight},
    frame::{CutDepth, DepthView, Rectifier, drop_edges, unproject},
    fuse,
    subject::find_volume,
    survey,
    test_scene::{Memory, Scene, column_distance, figure_distance, steps},
    tracking::{register, samples, track},
};

fn settings() -> FusionSettings {
    FusionSettings { voxel_size: 0.008, truncation: 0.03, target_triangles: 20_000, ..FusionSettings::default() }
}

/// The figure alone.
fn view(scene: &Scene, angle: f64, seed: u64) -> DepthView {
    let bare = Scene { with_floor: false, with_wall: false, ..scene.clone() };
    let rig = bare.rig();
    let rectifier = Rectifier::new(&rig.sensors[0], 6.0);
    let depth = rectifier.rectify(&bare.render(Some(angle), seed));
    CutDepth::new(&rectifier.camera, &drop_edges(&rectifier.camera, &depth, 8.3), 0.001).view(2)
}

fn difference(a: &Rigid, b: &Rigid) -> (f64, f64) {
    let d = a.inverse() * b;
    let body = Point3::new(0.0, 0.0, 2.3);
    ((d * body - body).norm(), d.rotation.angle().to_degrees())
}

/// Mean distance of the scan's vertices to the true figure after the best rigid fit known from the first pose.
fn mean_error(scan: &Scan, scene: &Scene) -> f64 {
    let figure_from_scan = scene.figure_from_camera(0.0) * scan.trajectory[0].scan_from_camera.inverse();
    let seen = scan.mesh.positions.iter().zip(&scan.mesh.attributes["filled"]).filter(|(_, f)| **f == 0.0);
    let errors: Vec<f64> = seen.map(|(p, _)| figure_distance(&(figure_from_scan * p.cast::<f64>())).abs()).collect();
    errors.iter().sum::<f64>() / errors.len() as f64
}

#[test]
fn a_frame_tracked_against_its_own_model_stays() {
    let scene = Scene::new();
    let view = view(&scene, 0.3, 7);
    let pose = scene.figure_from_camera(0.3);
    let mut model = Tsdf::new(0.004, 0.016, false);
    integrate(&mut model, &view, &pose).unwrap();
    let tracked = track(&model, &view, &pose);
    let (shift, angle) = difference(&pose, &tracked.model_from_camera);
    assert!(shift < 5e-5 && angle < 0.005, "{:.4} mm {angle:.5}°", shift * 1e3);
    assert!(tracked.converged && tracked.overlap > 0.9 && tracked.conditioning > 1e-3, "{tracked:?}");
}

#[test]
fn the_ray_cast_lies_on_the_measured_surface() {
    let scene = Scene { noise: 0.0, ..Scene::new() };
    let view = view(&scene, 0.3, 7);
    let pose = scene.figure_from_camera(0.3);
    let mut model = Tsdf::new(0.004, 0.016, false);
    integrate(&mut model, &view, &pose).unwrap();
    let seen = ray_cast(&model, &view.camera, &pose, 1);
    let camera_from_figure = pose.inverse();
    let mut offsets: Vec<f64> = view
        .samples(1)
        .filter_map(|i| {
            let hit = seen.hits[i]?;
            let p = camera_from_figure * Point3::from(hit.point).cast::<f64>();
            Some(p.z - f64::from(view.elements[i].depth()))
        })
        .collect();
    let count = view.samples(1).count();
    assert!(offsets.len() > count * 8 / 10, "{} of {count}", offsets.len());
    offsets.sort_unstable_by(f64::total_cmp);
    let median = offsets[offsets.len() / 2];
    assert!(median.abs() < 1e-4, "median offset {:.3} mm", median * 1e3);
}

#[test]
fn a_plane_and_a_sphere_come_out_where_they_are() {
    let camera = toile_geometry::camera::PinholeCamera::ideal(160, 120, 200.0, 200.0, 79.5, 59.5);
    let center = Point3::new(0.0, 0.0, 1.0);
    let sphere = |ray: [f32; 3]| {
        let d = nalgebra::Vector3::from(ray).cast::<f64>();
        let (a, b, c) = (d.norm_squared(), d.dot(&center.coords), center.coords.norm_squared() - 0.04);
        let root = b * b - a * c;
        if root > 0.0 { ((b - root.sqrt()) / a) as f32 } else { 1.3 }
    };
    let depth: Vec<f32> =
        (0..160 * 120).map(|i| sphere(unproject(&camera, (i % 160) as f32, (i / 160) as f32, 1.0))).collect();
    let filtered = drop_edges(&camera, &depth, 8.3);
    let view = DepthView::new(&camera, &filtered, 2);
    let mut tsdf = Tsdf::new(0.004, 0.016, false);
    integrate(&mut tsdf, &view, &Rigid::identity()).unwrap();
    let mesh = extract_surface(&tsdf, 1);
    let (mut near_sphere, mut near_plane) = (0, 0);
    for p in &mesh.positions {
        let p = p.cast::<f64>();
        let (s, w) = (((p - center).norm() - 0.2).abs(), (p.z - 1.3).abs());
        assert!(s.min(w) < 2.5e-3, "{p} is {:.2} mm off", s.min(w) * 1e3);
        if s < w { near_sphere += 1 } else { near_plane += 1 }
    }
    assert!(near_sphere > 2000 && near_plane > 2000, "{near_sphere} {near_plane}");
}

#[test]
fn a_solid_sphere_is_extracted_closed_and_manifold() {
    let mut tsdf = Tsdf::new(0.01, 0.04, false);
    tsdf.cover([-5, -5, -5], [5, 5, 5]).unwrap();
    for b in 0..11i32.pow(3) {
        tsdf.slot_or_new([b % 11 - 5, b / 11 % 11 - 5, b / 121 - 5]);
    }
    for slot in 0..tsdf.block_count() {
        let c = tsdf.coords[slot];
        for k in 0..VOXELS as i32 {
            let v = [c[0] * 8 + k % 8, c[1] * 8 + k / 8 % 8, c[2] * 8 + k / 64].map(|x| f64::from(x) * 0.01);
            // Two spheres that just touch make ambiguous cells.
            let d = ((v[0] - 0.151).hypot(v[1]).hypot(v[2]) - 0.15).min((v[0] + 0.152).hypot(v[1]).hypot(v[2]) - 0.15);
            let sdf = (d / 0.04 * 32767.0).clamp(-32767.0, 32767.0) as i16;
            tsdf.blocks[slot].sdf[k as usize] = sdf;
            tsdf.blocks[slot].weight[k as usize] = 64;
        }
    }
    let mesh = extract_surface(&tsdf, 1);
    assert!(Edges::new(&mesh.triangles).is_closed());
    mesh.validate().unwrap();
    let volume = 2.0 * 4.0 / 3.0 * std::f64::consts::PI * 0.15f64.powi(3);
    assert!((mesh.signed_volume() - volume).abs() < 0.02 * volume, "{}", mesh.signed_volume());
}

#[test]
fn joint_optimisation_recovers_disturbed_poses() {
    let scene = Scene { noise: 0.001, ..Scene::new() };
    let angles: Vec<f64> = (0..24).map(|i| f64::from(i) * 15.3f64.to_radians()).collect();
    let views: Vec<DepthView> = angles.iter().enumerate().map(|(i, &a)| view(&scene, a, i as u64)).collect();
    let truth: Vec<Rigid> = angles.iter().map(|&a| scene.figure_from_camera(a)).collect();
    let mut poses: Vec<Rigid> = truth
        .iter()
        .enumerate()
        .map(|(i, t)| {
            let k = i as f64;
            let twist = nalgebra::Vector3::new(0.001 * k.sin(), 0.0012 * k, 0.001 * k.cos());
            nalgebra::Isometry3::new(nalgebra::Vector3::new(4e-4 * k, 3e-4 * k, 0.003 * (3.0 * k).sin()), twist) * t
        })
        .collect();
    poses[0] = truth[0];
    let before: f64 = truth.iter().zip(&poses).map(|(t, p)| difference(t, p).0).sum::<f64>() / 24.0;
    let closing = close(&views, &vec![0; views.len()], &mut poses, 8);
    let after: f64 = truth.iter().zip(&poses).map(|(t, p)| difference(t, p).0).sum::<f64>() / 24.0;
    assert!(before > 0.006 && after < 0.0008, "{before} -> {after}, {closing:?}");
    assert!(closing.seam_pairs > 0 && closing.seam_after < closing.seam_before);
}

#[test]
fn a_full_turn_becomes_one_closed_figure_on_the_disk() {
    let scene = Scene::new();
    let scan = fuse(&mut scene.source(&steps(52, 7.1)), &settings(), &|_| {}).unwrap();
    let report = &scan.report;
    assert_eq!((report.frames_fused, report.dropped.len()), (52, 0), "{:?}", report.dropped);
    assert!((report.turned_deg - 51.0 * 7.1).abs() < 0.5 && report.full_turn, "{}", report.turned_deg);
    assert!(report.watertight && report.warnings.is_empty(), "{:?}", report.warnings);
    let volume = report.volume.as_ref().unwrap();
    assert!(volume.floor_found, "{volume:?}");
    let error = mean_error(&scan, &scene);
    assert!(error < 0.0015, "{:.2} mm", error * 1e3);
    let (lo, hi) = scan.mesh.bounds().unwrap();
    assert!(lo.y.abs() < 0.004 && hi.y > 1.66 && hi.y < 1.715, "the crown is not seen: {lo} {hi}");
    assert!(lo.x > -0.62 && hi.x < 0.62, "disk or floor is left: {lo} {hi}");
    let first = scan.trajectory[0].scan_from_camera.translation.vector;
    assert!(first.x.abs() < 1e-6 && first.z > 2.2, "+Z looks at the first camera: {first}");
}

/// A small camera whose noise over the disk is as large as that of a Kinect v2: a standard deviation of 7 mm along the ray.
fn noisy() -> Scene {
    let camera = toile_geometry::camera::PinholeCamera::ideal(160, 138, 136.0, 136.0, 79.5, 69.0);
    Scene { camera, noise: 0.012, ..Scene::new() }
}

#[test]
fn a_long_noisy_take_has_no_disk_in_its_scan() {
    let scene = noisy();
    let scan = fuse(&mut scene.source(&steps(300, 1.22)), &settings(), &|_| {}).unwrap();
    assert_eq!(scan.report.frames_fused, 300, "{:?}", scan.report.dropped.first());
    // The figure's feet end within 0.3 m of the axis.
    let beside = |p: &&Point3<f32>| p.y < 0.05 && p.x.hypot(p.z) > 0.33;
    let (low, all) = (scan.mesh.positions.iter().filter(beside).count(), scan.mesh.positions.len());
    assert_eq!(low, 0, "of {all} vertices lie on the disk");
    let error = mean_error(&scan, &scene);
    assert!(error < 0.0035, "{:.2} mm", error * 1e3);
}

/// Depth noise must not move the disk: the farthest depths of a pixel lie behind it by twice the noise.
#[test]
fn the_disk_is_found_where_it_is_however_noisy_it_is() {
    let scene = noisy();
    let volume = survey(&scene.rig(), &scene.frames(&steps(40, 9.0)), &settings()).unwrap();
    let floor = volume.floor.as_ref().unwrap();
    let height = (scene.room_from_camera * floor.point).y;
    assert!(height.abs() < 0.0015, "{:.2} mm above the disk", height * 1e3);
    // Uniform noise of 12 mm along the ray, seen from 1 m above at 2.3 m.
    let sigma = 0.012 / 3f64.sqrt() * 0.4;
    assert!(volume.bottom.unwrap() > 3.0 * sigma && volume.bottom.unwrap() < 6.0 * sigma, "{:?}", volume.bottom);
}

#[test]
fn a_surface_needs_more_weight_in_a_longer_take_of_a_subject_that_turns() {
    let turning = settings();
    assert_eq!([3, 100, 200, 2000].map(|frames| minimum_weight(&turning, true, frames)), [2, 2, 4, 40]);
    let hand_held = FusionSettings { prior: Prior::None, ..settings() };
    assert_eq!((minimum_weight(&hand_held, true, 2000), minimum_weight(&turning, false, 2000)), (2, 2));
}

#[test]
fn sensors_that_known_poses_do_not_place_are_a_warning() {
    let scene = Scene { with_floor: false, with_wall: false, ..Scene::new() };
    let pose = |f: &toile_capture::Frame| KnownPose {
        device_time_ns: f.device_time_ns,
        scan_from_camera: scene.figure_from_camera((6.0 * f.index as f64).to_radians()),
    };
    let poses = scene.frames(&steps(4, 6.0)).iter().map(pose).collect();
    let whole = FusionSettings { volume: Volume::All, poses: Some(poses), ..settings() };
    let mut source = scene.source(&steps(4, 6.0));
    let fused = |source: &mut Memory| fuse(source, &whole, &|_| {}).unwrap().report;
    assert_eq!(fused(&mut source).sensors_not_used, [""; 0]);
    // Three more sensors, of which the last gives colour alone.
    for (k, name) in [(1, "left"), (2, "right"), (3, "webcam")] {
        source.rig.sensors.push(toile_capture::Sensor { name: name.into(), ..source.rig.sensors[0].clone() });
        let frame = |f: &toile_capture::Frame| toile_capture::Frame { sensor: k, ..f.clone() };
        source.frames.extend(source.frames[..4].iter().map(frame).collect::<Vec<_>>());
    }
    source.frames[12..].iter_mut().for_each(|f| f.depth = None);
    source.next = 0;
    let report = fused(&mut source);
    assert_eq!((report.sensors_not_used.join(" "), report.frames_seen), ("left right".into(), 4));
    assert!(report.warnings.iter().any(|w| w.contains("`left`, `right`")), "{:?}", report.warnings);
}

#[test]
fn the_result_does_not_depend_on_threads() {
    let scene = Scene::new();
    let frames = scene.frames(&steps(14, 7.0));
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut source = Memory { rig: scene.rig(), frames: frames.clone(), next: 0 };
        let scan = pool.install(|| fuse(&mut source, &settings(), &|_| {})).unwrap();
        (ply::encode(&scan.mesh), scan.trajectory_tum(), serde_json::to_string(&scan.report).unwrap())
    };
    let one = run(1);
    assert!(one == run(2) && one == run(3));
}

#[test]
fn a_part_of_a_turn_is_a_warning() {
    let scene = Scene { with_floor: false, ..Scene::new() };
    let scan = fuse(&mut scene.source(&steps(26, -8.0)), &settings(), &|_| {}).unwrap();
    assert!((scan.report.turned_deg - 200.0).abs() < 1.5, "{}", scan.report.turned_deg);
    assert!(
        scan.report.warnings.iter().any(|w| w.contains("the turn is not full: 200°")),
        "{:?}",
        scan.report.warnings
    );
    assert!(mean_error(&scan, &scene) < 0.002, "{}", mean_error(&scan, &scene));
}

#[test]
fn an_empty_room_holds_nobody() {
    let scene = Scene::new();
    let error = fuse(&mut scene.source(&[None; 12]), &settings(), &|_| {}).unwrap_err();
    assert!(matches!(error, FusionError::NobodyInIt { .. }), "{error}");
    assert!(error.to_string().contains("nobody in it"));
}

#[test]
fn a_foreign_frame_is_left_out_and_a_gap_is_crossed() {
    let scene = Scene::new();
    let mut angles = steps(60, 4.0);
    angles[20] = Some(angles[20].unwrap() + 2.5); // somebody jumped
    let mut source = scene.source(&angles);
    source.frames.drain(25..27);
    let scan = fuse(&mut source, &settings(), &|_| {}).unwrap();
    assert_eq!(scan.report.dropped.iter().map(|d| d.index).collect::<Vec<_>>(), [20]);
    assert!(mean_error(&scan, &scene) < 0.002);
}

#[test]
fn known_poses_are_taken_as_they_are() {
    let scene = Scene::new();
    let angles = steps(12, 30.0);
    let pose = |i: usize| scene.figure_from_camera(angles[i].unwrap());
    let poses = (0..12).map(|i| KnownPose { device_time_ns: 200_000_000 * i as i64, scan_from_camera: pose(i) });
    let settings = FusionSettings { poses: Some(poses.collect()), ..settings() };
    let scan = fuse(&mut scene.source(&angles), &settings, &|_| {}).unwrap();
    assert_eq!(scan.trajectory.len(), 12);
    assert!((0..12).all(|i| difference(&pose(i), &scan.trajectory[i].scan_from_camera).0 < 1e-9));
    assert!(mean_error(&scan, &scene) < 0.0015);
}

#[test]
fn settings_out_of_range_and_missing_depth_are_refused() {
    let scene = Scene::new();
    let bad = FusionSettings { truncation: 0.004, ..settings() };
    let error = fuse(&mut scene.source(&steps(12, 30.0)), &bad, &|_| {}).unwrap_err();
    assert!(matches!(error, FusionError::Settings(_)), "{error}");
    let mut huge = scene.rig();
    (huge.sensors[0].depth.width, huge.sensors[0].depth.height) = (5000, 5000);
    assert!(matches!(crate::Fuser::new(&huge, None, settings()), Err(FusionError::Calibration { sensor: 0, .. })));
    let mut source = scene.source(&steps(3, 8.0));
    source.frames.iter_mut().for_each(|f| f.depth = None);
    assert!(matches!(fuse(&mut source, &settings(), &|_| {}), Err(FusionError::NoDepth { frames: 3 })));
}

/// A column's turn by tracking alone and by the finished trajectory, degrees off the truth, and frames held by colour.
fn column_turn(with_color: bool) -> (f64, f64, usize) {
    let scene =
        Scene { shape: column_distance, with_color, with_floor: false, with_wall: false, noise: 0.001, ..Scene::new() };
    let volume = SubjectVolume {
        model_from_camera: scene.room_from_camera,
        radius: 0.5,
        bottom: Some(0.0),
        floor: None,
        image_up: ImageSide::Top,
    };
    let mut fuser = crate::Fuser::new(&scene.rig(), Some(volume), settings()).unwrap();
    let angles = steps(30, 6.0);
    for frame in scene.frames(&angles) {
        let outcome = fuser.push(&frame).unwrap();
        assert!(matches!(outcome, Outcome::Fused { .. }), "{outcome:?}");
    }
    let truth = scene.figure_from_camera(0.0).inverse() * scene.figure_from_camera(angles[29].unwrap());
    let off = |a: &Rigid, b: &Rigid| (a.inverse() * b).rotation.angle_to(&truth.rotation).to_degrees();
    let tracked = off(&fuser.kept.frames[0].model_from_camera, &fuser.kept.frames[29].model_from_camera);
    let scan = crate::finish(fuser, &|_| {}).unwrap();
    let finished = off(&scan.trajectory[0].scan_from_camera, &scan.trajectory[29].scan_from_camera);
    (tracked, finished, scan.report.frames_by_color)
}

#[test]
fn colours_hold_a_column_that_its_shape_lets_slip() {
    let (by_shape, _, none) = column_turn(false);
    assert!(by_shape > 90.0 && none == 0, "{by_shape}° off");
    let (tracked, finished, by_color) = column_turn(true);
    assert!(tracked < 2.0 && finished < 2.0, "{tracked}° off when tracked, {finished}° when finished");
    assert_eq!(by_color, 29);
}

#[test]
fn a_subject_that_turned_unseen_is_found_again_without_looking_ahead() {
    let scene = Scene::new();
    let mut angles = steps(44, 6.0);
    angles[24..].iter_mut().for_each(|a| *a = a.map(|a| a + 25.0f64.to_radians()));
    let frames = scene.frames(&angles);
    let volume = survey(&scene.rig(), &frames[..20], &settings()).unwrap();
    let first = volume.model_from_camera;
    let mut fuser = crate::Fuser::new(&scene.rig(), Some(volume), settings()).unwrap();
    let mut dropped = Vec::new();
    for (i, frame) in frames.iter().enumerate() {
        match fuser.push(frame).unwrap() {
            Outcome::Fused { model_from_camera, .. } => {
                let moved = scene.figure_from_camera(0.0).inverse() * scene.figure_from_camera(angles[i].unwrap());
                let (shift, angle) = difference(&(first * moved), &model_from_camera);
                assert!(shift < 0.02 && angle < 1.0, "frame {i}: {:.1} mm {angle:.2}°", shift * 1e3);
                assert_eq!(fuser.lost_frames(), 0);
            }
            Outcome::Dropped { reason } => {
                assert!(!matches!(reason, DropReason::NoDepth | DropReason::TooFewPixels { .. }), "{reason}");
                dropped.push(i);
                assert_eq!(fuser.lost_frames(), dropped.len());
            }
        }
    }
    assert!(dropped.first() == Some(&24) && dropped.len() <= 6, "{dropped:?}");
}

#[test]
fn frames_pushed_one_by_one_report_their_pose() {
    let scene = Scene::new();
    let frames = scene.frames(&steps(8, 6.0));
    let volume = survey(&scene.rig(), &frames, &settings()).unwrap();
    let mut fuser = crate::Fuser::new(&scene.rig(), Some(volume), settings()).unwrap();
    for (i, frame) in frames.iter().enumerate() {
        match fuser.push(frame).unwrap() {
            Outcome::Fused { tracked, .. } => assert_eq!(tracked.is_some(), i > 0),
            Outcome::Dropped { reason } => panic!("{reason}"),
        }
    }
    assert_eq!(crate::finish(fuser, &|_| {}).unwrap().trajectory.len(), 8);
}

#[test]
fn the_volume_has_the_axis_the_floor_and_nothing_else() {
    let scene = Scene::new();
    let rectifier = Rectifier::new(&scene.rig().sensors[0], 6.0);
    let depths: Vec<Vec<f32>> = steps(20, 18.0)
        .iter()
        .enumerate()
        .map(|(i, a)| rectifier.rectify(&scene.render(*a, i as u64)))
        .map(|depth| drop_edges(&rectifier.camera, &depth, 8.3))
        .collect();
    let volume = find_volume(&scene.camera, &depths).unwrap();
    let (shift, angle) = difference(&scene.room_from_camera, &volume.model_from_camera);
    assert!(shift < 0.15, "{shift}");
    assert!(angle < 2.0, "{angle}");
    assert!(volume.radius > 0.55 && volume.radius < 0.8, "{}", volume.radius);
    let registered =
        register(&Tsdf::new(0.004, 0.016, false), &samples(&view(&scene, 0.0, 1), 500), &Rigid::identity());
    assert!(!registered.converged && registered.overlap == 0.0, "a registration to nothing must not succeed");
}
