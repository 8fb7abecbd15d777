//! Motions that other people's programs wrote (see `data/README.md`).
#![allow(clippy::unwrap_used)] // helpers of tests are not seen as tests

use std::path::Path;

use nalgebra::{Point3, Vector3};
use toile_animation::bvh;

/// Checks `file` against the positions (frame, joint, x, y, z) in `positions`.
fn assert_agrees(file: &str, positions: &str, channels: usize, end_site: Vector3<f64>) {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let motion = bvh::read(&data.join(file)).unwrap();
    assert!(motion.warnings.is_empty(), "{:?}", motion.warnings);
    assert_eq!((motion.frames.len(), motion.frame_time, motion.channel_count()), (5, 0.04, channels));
    let names: Vec<&str> = motion.joints.iter().map(|j| j.name.as_str()).collect();
    assert_eq!(names, ["Hips", "Spine", "LeftArm", "LeftHand", "RightLeg"]);
    assert!((motion.joints[3].end_site.unwrap() - end_site).norm() < 1e-5);
    let expected = std::fs::read_to_string(data.join(positions)).unwrap();
    assert_eq!(expected.lines().count(), 25);
    for line in expected.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let joint = names.iter().position(|n| *n == words[1]).unwrap();
        let place = Point3::from([2, 3, 4].map(|k: usize| words[k].parse::<f64>().unwrap()));
        let found = motion.joint_frames(words[0].parse().unwrap())[joint].translation.vector;
        assert!((place.coords - found).norm() < 2e-3, "{file}: {line}, but ours is {found}");
    }
}

#[test]
fn joints_stand_where_bvhio_puts_them() {
    assert_agrees("bvhio.bvh", "bvhio_positions.txt", 18, Vector3::new(0.0, 10.0, 0.0));
}

/// Z is up, and every joint has position channels that repeat its offset.
#[test]
fn joints_stand_where_blender_puts_them() {
    assert_agrees("blender.bvh", "blender_positions.txt", 30, Vector3::new(0.0, 0.0, 10.0));
}
