//! An outfit in real time: a person in a skirt and a jumper.
#![allow(clippy::unwrap_used)] // all of it is test code

mod common;

use common::{dressed, striding};
use nalgebra::{Point3, Vector3};
use toile_animation::{
    blend::{Blend, Outfit, Wearer},
    realtime::Live,
};
use toile_character::{Pose, Skinning};
use toile_geometry::{Mesh, bvh::Bvh, intersection::crossings};

/// The layers after a second of steps at so many frames a second.
fn after_a_second(outfit: &Outfit, rate: u32) -> Vec<Vec<Point3<f32>>> {
    let mut live = Live::new(outfit, Skinning::Linear).unwrap();
    for frame in 1..=rate {
        live.advance(1.0 / f64::from(rate), &striding(f64::from(frame) / f64::from(rate))).unwrap();
    }
    live.layers().to_vec()
}

fn mean_distance(a: &[Point3<f32>], b: &[Point3<f32>]) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).sum::<f32>() / a.len() as f32
}

/// Pairs of triangles of body and skirt that cross.
fn crossing(outfit: &Outfit, places: &[Vec<Point3<f32>>]) -> usize {
    let mesh = |k: usize| {
        let mesh = Mesh::new(places[k].clone(), outfit.layers()[k].mesh.triangles.clone());
        let bvh = Bvh::new(&mesh.positions, &mesh.triangles);
        (mesh, bvh)
    };
    let (body, skirt) = (mesh(0), mesh(1));
    crossings(&body.0, &body.1, &skirt.0, &skirt.1).len()
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let outfit = dressed();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| after_a_second(&outfit, 24))
    };
    let one = with(1);
    assert_eq!(one, with(3));
    assert_eq!(one, with(1), "the same again");
}

#[test]
fn the_rate_of_frames_makes_little_difference() {
    let outfit = dressed();
    let slow = after_a_second(&outfit, 30);
    for rate in [25, 48, 90, 144] {
        let fast = after_a_second(&outfit, rate);
        for k in 1..slow.len() {
            let off = mean_distance(&slow[k], &fast[k]);
            println!("{rate} frames a second, layer {k}: {off} m");
            assert!(off < 0.004, "{rate} frames a second, layer {k}: {off} m");
        }
    }
}

#[test]
fn a_skirt_swings_and_comes_to_rest_as_it_was_scanned() {
    let outfit = dressed();
    let mut live = Live::new(&outfit, Skinning::Linear).unwrap();
    let mut pose = Pose::identity();
    let (mut most, mut before, mut speed) = (0.0f32, Vec::new(), 0.0);
    for frame in 0..75 {
        // A step of 0.3 m aside within 0.3 s, then two seconds of standing.
        pose.translation = Vector3::new(0.3 * (f64::from(frame) / 9.0).min(1.0), 0.0, 0.0);
        live.advance(1.0 / 30.0, &pose).unwrap();
        let carried: Vec<Point3<f32>> = outfit.scanned(1).iter().map(|p| p + pose.translation.cast::<f32>()).collect();
        let skirt = &live.layers()[1];
        most = most.max(skirt.iter().zip(&carried).map(|(a, b)| (a - b).norm()).fold(0.0, f32::max));
        if frame == 74 {
            speed = 30.0 * mean_distance(skirt, &before);
            let off = mean_distance(skirt, &carried);
            println!("left its place by {most} m; after two seconds {off} m off, {speed} m/s");
            assert!(off < 0.005, "{off} m from the scan");
        }
        before.clone_from(skirt);
    }
    assert!(most > 0.03, "the hem leaves its place by {most} m only");
    assert!(speed < 0.002, "{speed} m/s after two seconds");
}

#[test]
fn legs_that_stride_stay_inside_the_skirt() {
    let outfit = dressed();
    let mut live = Live::new(&outfit, Skinning::Linear).unwrap();
    let mut skinned = Wearer::new(&outfit, Blend::Skinning, Skinning::Linear);
    let (mut crossing_live, mut crossing_skinned) = (0, 0);
    for frame in 0..45 {
        let pose = striding(f64::from(frame) / 30.0);
        live.advance(1.0 / 30.0, &pose).unwrap();
        skinned.advance(&pose, 1.0 / 30.0).unwrap();
        if frame % 5 == 0 {
            crossing_live += crossing(&outfit, live.layers());
            crossing_skinned += crossing(&outfit, skinned.layers());
        }
    }
    println!("{crossing_live} pairs cross, {crossing_skinned} by weights");
    assert!(crossing_skinned > 100 && crossing_live * 2 < crossing_skinned, "{crossing_live} of {crossing_skinned}");
}

#[test]
fn what_is_no_pose_is_refused_and_jumps_are_survived() {
    let outfit = dressed();
    let mut live = Live::new(&outfit, Skinning::Linear).unwrap();
    let before = live.layers().to_vec();
    let mut bad = Pose::identity();
    bad.translation.y = f64::NAN;
    let short = Pose { rotations: Vec::new(), ..Pose::identity() };
    for (pose, seconds, says) in
        [(&bad, 0.1, "not finite"), (&short, 0.1, "0 rotations"), (&Pose::identity(), -1.0, "0 or more")]
    {
        let error = live.advance(seconds, pose).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    }
    assert_eq!(before, live.layers());
    // Two metres in a frame, in no time, and after a minute.
    for (seconds, x) in [(1.0 / 30.0, 2.0), (0.0, 4.0), (60.0, 6.0)] {
        let pose = Pose { translation: Vector3::new(x, 0.0, 0.0), ..Pose::identity() };
        live.advance(seconds, &pose).unwrap();
        assert!(live.layers().iter().flatten().all(|p| p.coords.iter().all(|c| c.is_finite() && c.abs() < 10.0)));
    }
}
