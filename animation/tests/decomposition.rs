//! Helper joints: known bones found again, a swinging skirt followed, bad input.
#![allow(clippy::unwrap_used)] // helpers of tests are not seen as tests

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use toile_animation::decomposition::{DecompositionSettings, LayerHelpers, LayerMotion, decompose, sample_frames};
use toile_character::{SkinWeights, skinning};

/// A layer and all that it does.
struct Scene {
    rest: Vec<Point3<f32>>,
    weights: SkinWeights,
    joints: Vec<Vec<Isometry3<f64>>>,
    frames: Vec<Vec<Point3<f32>>>,
}

impl Scene {
    fn layer(&self) -> LayerMotion<'_> {
        LayerMotion { rest: &self.rest, weights: &self.weights, frames: &self.frames }
    }

    /// The scene in the frames that a decomposition is made from.
    fn sampled(&self) -> Self {
        let kept = sample_frames(self.frames.len());
        Self {
            rest: self.rest.clone(),
            weights: self.weights.clone(),
            joints: kept.iter().map(|&f| self.joints[f].clone()).collect(),
            frames: kept.iter().map(|&f| self.frames[f].clone()).collect(),
        }
    }

    /// Distances between the played vertices and the true ones in every frame, ascending, metres.
    fn errors(&self, found: &LayerHelpers) -> Vec<f64> {
        let mut errors = Vec::new();
        for (joints, frame) in self.joints.iter().zip(&self.frames) {
            let mut transforms = joints.clone();
            transforms.resize(found.first, Isometry3::identity());
            transforms.extend(found.solve(joints, frame).unwrap());
            let played = skinning::skin(&self.rest, &found.weights, &transforms);
            errors.extend(played.iter().zip(frame).map(|(a, b)| f64::from((a - b).norm())));
        }
        errors.sort_by(f64::total_cmp);
        errors
    }
}

fn mean(errors: &[f64]) -> f64 {
    errors.iter().sum::<f64>() / errors.len() as f64
}

fn quantile(errors: &[f64], share: f64) -> f64 {
    errors[((errors.len() - 1) as f64 * share) as usize]
}

/// A sheet of 1 m that a joint carries at one end and two unknown bones bend further out.
fn bent_sheet() -> Scene {
    let (mut rest, mut weights, mut truth) = (Vec::new(), SkinWeights::default(), SkinWeights::default());
    for i in 0..1200 {
        let (x, y) = ((i / 30) as f32 / 39.0, (i % 30) as f32 / 100.0);
        rest.push(Point3::new(x, 1.0 + y, 0.02 * (9.0 * x).sin()));
        weights.push(&[(0, 1.0)]);
        let tent = |center: f32| (1.0 - (x - center).abs() / 0.5).max(0.0);
        truth.push(&[(0, tent(0.0)), (1, tent(0.5)), (2, tent(1.0))]);
    }
    let (mut joints, mut frames) = (Vec::new(), Vec::new());
    for f in 0..80 {
        let t = f64::from(f) / 80.0 * TAU;
        let root = Isometry3::new(Vector3::new(0.4 * t, 0.05 * t.sin(), 0.0), Vector3::y() * 0.3 * t.cos());
        let bend = |x: f64, angle: f64| {
            Isometry3::rotation_wrt_point(
                UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle),
                Point3::new(x, 1.1, 0.0),
            )
        };
        let first = root * bend(0.25, 0.6 * (2.0 * t).sin());
        let second = first * bend(0.75, 0.8 * (3.0 * t).cos());
        frames.push(skinning::skin(&rest, &truth, &[root, first, second]));
        joints.push(vec![root]);
    }
    Scene { rest, weights, joints, frames }
}

/// A skirt of 4,800 vertices around hips and two legs that walk; it swings after the hips and waves run around its hem.
fn skirt(swing: f64) -> Scene {
    let (rows, around) = (40, 120);
    let (mut rest, mut weights) = (Vec::new(), SkinWeights::default());
    for i in 0..rows * around {
        let (down, angle) = ((i / around) as f64 / (rows - 1) as f64, (i % around) as f64 / around as f64 * TAU);
        let radius = 0.14 + 0.2 * down;
        rest.push(Point3::new(radius * angle.sin(), 1.0 - 0.55 * down, 0.8 * radius * angle.cos()).cast::<f32>());
        let leg = (0.5 + 0.5 * angle.sin()) * down;
        weights.push(&[(0, (1.0 - down) as f32), (1, leg as f32), (2, (down - leg) as f32)]);
    }
    let (mut joints, mut frames) = (Vec::new(), Vec::new());
    for f in 0..150 {
        let t = f64::from(f) / 30.0;
        let hips = |t: f64| {
            let turn = Vector3::new(0.05 * (5.0 * t).sin(), 0.3 * (2.5 * t).sin(), 0.06 * (5.0 * t).cos());
            Isometry3::new(Vector3::new(0.03 * (5.0 * t).sin(), 0.02 * (10.0 * t).sin(), 1.2 * t), turn)
        };
        let leg = |side: f64| {
            let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.5 * side * (5.0 * t).sin());
            hips(t) * Isometry3::rotation_wrt_point(turn, Point3::new(0.09 * side, 0.95, 0.0))
        };
        let wave = |(i, p): (usize, &Point3<f32>)| {
            let (down, angle) = ((i / around) as f64 / (rows - 1) as f64, (i % around) as f64 / around as f64 * TAU);
            let late = hips(t - 0.12 * down);
            let out = Vector3::new(angle.sin(), 0.0, angle.cos());
            let fold = 0.03 * (3.0 * angle - 5.0 * t + 2.0 * down).sin() + 0.008 * (7.0 * angle + 8.0 * t).sin();
            let sway = Vector3::new(0.06 * (5.0 * t - 1.5 * down).cos(), 0.0, 0.05 * (10.0 * t - down).sin());
            let own = swing * down * down * (fold * out + sway);
            let forward = Vector3::new(0.0, 0.0, hips(t).translation.z - late.translation.z);
            (late * (p.cast::<f64>() + own) + forward).cast::<f32>()
        };
        frames.push(rest.iter().enumerate().map(wave).collect());
        joints.push(vec![hips(t), leg(1.0), leg(-1.0)]);
    }
    Scene { rest, weights, joints, frames }
}

fn skin_errors(scene: &Scene) -> Vec<f64> {
    let of = |(joints, frame): (&Vec<Isometry3<f64>>, &Vec<Point3<f32>>)| {
        let moved = skinning::skin(&scene.rest, &scene.weights, joints);
        moved.iter().zip(frame).map(|(a, b)| f64::from((a - b).norm())).collect::<Vec<_>>()
    };
    let mut errors: Vec<f64> = scene.joints.iter().zip(&scene.frames).flat_map(of).collect();
    errors.sort_by(f64::total_cmp);
    errors
}

fn helpers(count: usize) -> DecompositionSettings {
    DecompositionSettings { helpers: count, ..Default::default() }
}

#[test]
fn known_bones_are_found_again() {
    let scene = bent_sheet();
    let sampled = scene.sampled();
    let found = &decompose(&[sampled.layer()], &sampled.joints, &helpers(2)).unwrap()[0];
    assert_eq!(found.centers.len(), 2);
    let errors = scene.errors(found);
    println!("mean {:.6} m, p99 {:.6} m", mean(&errors), quantile(&errors, 0.99));
    assert!(mean(&errors) < 0.0002 && quantile(&errors, 0.99) < 0.002);
    assert!(mean(&skin_errors(&scene)) > 0.05);
}

/// Frames between the sampled ones count, too. The bars are those of a motion that a player shows in place of the caches.
#[test]
fn a_swinging_skirt_is_followed() {
    let scene = skirt(1.0);
    let sampled = scene.sampled();
    assert!(scene.frames.len() > 2 * sampled.frames.len());
    let skin = skin_errors(&scene);
    println!("skinning: mean {:.4} m, p99 {:.4} m", mean(&skin), quantile(&skin, 0.99));
    for (count, bars) in [(8, [0.003, 0.012]), (16, [0.0015, 0.006]), (32, [0.0008, 0.003])] {
        let start = std::time::Instant::now();
        let found = &decompose(&[sampled.layer()], &sampled.joints, &helpers(count)).unwrap()[0];
        let (took, start) = (start.elapsed(), std::time::Instant::now());
        let errors = scene.errors(found);
        let frame = start.elapsed() / scene.frames.len() as u32;
        let (mean, p99) = (mean(&errors), quantile(&errors, 0.99));
        println!(
            "{count} helpers: mean {mean:.5} m, p99 {p99:.4} m; found in {took:.2?}, a frame solved in {frame:.2?}"
        );
        assert!(mean < bars[0] && p99 < bars[1]);
        assert!(found.weights.weights.iter().all(|w| (w.iter().sum::<f32>() - 1.0).abs() < 1e-5));
    }
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let scene = skirt(1.0);
    let sampled = scene.sampled();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let found = decompose(&[sampled.layer()], &sampled.joints, &helpers(6)).unwrap().remove(0);
            let solved = found.solve(&scene.joints[77], &scene.frames[77]).unwrap();
            (found.weights, found.centers, solved)
        })
    };
    assert!(with(1) == with(3));
}

#[test]
fn helpers_go_where_they_are_needed() {
    let (calm, wild, still) = (skirt(0.05), skirt(1.0), skirt(0.0));
    let rigid = Scene {
        frames: still.joints.iter().map(|j| skinning::skin(&still.rest, &still.weights, j)).collect(),
        ..still
    };
    let scenes = [calm.sampled(), rigid.sampled(), wild.sampled()];
    let layers: Vec<LayerMotion<'_>> = scenes.iter().map(Scene::layer).collect();
    let found = decompose(&layers, &scenes[0].joints, &helpers(20)).unwrap();
    let counts: Vec<usize> = found.iter().map(|l| l.centers.len()).collect();
    println!("{counts:?}");
    assert!(counts.iter().sum::<usize>() <= 20);
    assert!(counts[0] >= 1 && counts[2] > counts[0], "{counts:?}");
    assert_eq!((counts[1], &found[1].weights), (0, &rigid.weights), "what follows its skin stays as it is");
    assert_eq!((found[0].first, found[2].first), (3, 3 + counts[0]));
    let used = |l: &LayerHelpers| l.weights.joints.iter().flatten().map(|&j| usize::from(j)).max().unwrap();
    assert_eq!(used(&found[2]), 2 + counts[0] + counts[2]);
}

#[test]
fn helpers_rest_amid_their_vertices_and_without_a_budget_there_are_none() {
    let scene = skirt(1.0);
    let sampled = scene.sampled();
    let found = &decompose(&[sampled.layer()], &sampled.joints, &helpers(0)).unwrap()[0];
    assert!(found.centers.is_empty() && found.weights == scene.weights);
    let found = &decompose(&[sampled.layer()], &sampled.joints, &helpers(9)).unwrap()[0];
    for center in &found.centers {
        let nearest = scene.rest.iter().map(|p| (p.cast::<f64>() - center).norm()).fold(f64::INFINITY, f64::min);
        assert!(nearest < 0.15, "{center} is {nearest} m from the skirt");
    }
}

#[test]
fn what_does_not_fit_is_refused() {
    let scene = bent_sheet();
    let refused = |joints: &[Vec<Isometry3<f64>>], layer: LayerMotion<'_>, settings: DecompositionSettings| {
        decompose(&[layer], joints, &settings).unwrap_err().to_string()
    };
    let text = refused(&[], scene.layer(), helpers(4));
    assert_eq!(text, "motion: no frame to find helper joints from");
    let text = refused(&scene.joints, scene.layer(), helpers(201));
    assert_eq!(text, "setting helpers is 201; it must be from 0 to 200");
    let zero = DecompositionSettings { tolerance: 0.0, ..Default::default() };
    assert_eq!(refused(&scene.joints, scene.layer(), zero), "setting tolerance is 0; it must be above 0");
    let text = refused(&scene.joints[1..], scene.layer(), helpers(4));
    assert_eq!(text, "motion: layer 0: its 80 frames are not 79 of 1200 vertices");
    let torn = LayerMotion { rest: &scene.rest[1..], ..scene.layer() };
    assert!(refused(&scene.joints, torn, helpers(4)).starts_with("motion: layer 0: 1199 vertices, weights for 1200"));
    let mut frames = scene.frames.clone();
    frames[3][7].y = f32::NAN;
    let text = refused(&scene.joints, LayerMotion { frames: &frames, ..scene.layer() }, helpers(4));
    assert_eq!(text, "motion: layer 0, frame 3: vertex 7 is not finite");
    let sampled = scene.sampled();
    let found = decompose(&[sampled.layer()], &sampled.joints, &helpers(2)).unwrap().remove(0);
    assert!(
        found.solve(&[], &scene.frames[0]).is_err() && found.solve(&scene.joints[0], &scene.frames[0][1..]).is_err()
    );
    let text = found.solve(&scene.joints[0], &frames[3]).unwrap_err().to_string();
    assert_eq!(text, "motion: vertex 7 is not finite");
}

#[test]
fn one_frame_and_an_empty_layer_do_no_harm() {
    let scene = skirt(1.0);
    let empty = LayerMotion { rest: &[], weights: &SkinWeights::default(), frames: &[Vec::new()] };
    let one = LayerMotion { frames: &scene.frames[40..41], ..scene.layer() };
    let found = decompose(&[empty, one], &scene.joints[40..41], &helpers(12)).unwrap();
    assert!(found[0].centers.is_empty() && found[0].weights.is_empty());
    let solved = found[1].solve(&scene.joints[40], &scene.frames[40]).unwrap();
    assert!(solved.iter().all(|t| t.to_homogeneous().iter().all(|c| c.is_finite())));
    assert_eq!(sample_frames(0), [0; 0]);
    assert_eq!(sample_frames(3), [0, 1, 2]);
    let long = sample_frames(100_000);
    assert_eq!((long[0], long[long.len() - 1]), (0, 99_999));
}
