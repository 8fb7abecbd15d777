//! `toile calibrate`: rigs by a person who turns, stereo pairs by a chessboard, and what it refuses.

#![allow(clippy::unwrap_used)] // all of it is test code

mod common;

use std::{fs, path::Path};

use common::{exits, toile};
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};
use serde_json::Value;

const RIG: &str =
    "# ours\n[[sensor]]\ndevice = \"kinect2:A\"\n\n[[sensor]]\ndevice = \"kinect2:B\"\nname = \"camera-2\"\n";

/// A virtual person before sensors whose places are recorded 0.2 to 0.4 m wrong.
fn record(out: &Path, sensors: &str) {
    let mut command = toile();
    command.arg("synthesize").arg("--out").arg(out).args(["--garments", "", "--sensors", sensors, "--frames", "45"]);
    exits(0, command.args(["--rig-error", "400", "--rig-turn-error", "15", "--seed", "3"]));
}

/// Where the second sensor truly stands.
fn truth(subject: &Path) -> Isometry3<f64> {
    let text = fs::read(subject.join("truth/00-body/truth/rig.json")).unwrap();
    let rig: Value = serde_json::from_slice(&text).unwrap();
    let at = |i: usize, j: usize| rig["sensors"][1]["rig_from_depth"][i][j].as_f64().unwrap();
    let rotation = Rotation3::from_matrix(&Matrix3::from_fn(at));
    Isometry3::from_parts(Vector3::from_fn(|i, _| at(i, 3)).into(), UnitQuaternion::from_rotation_matrix(&rotation))
}

/// The numbers of the last `key = [...]` of a rig file.
fn numbers(text: &str, key: &str) -> Vector3<f64> {
    let line = text.lines().rfind(|l| l.starts_with(key)).unwrap();
    let inside = line.split(['[', ']']).nth(1).unwrap();
    Vector3::from_iterator(inside.split(',').map(|n| n.trim().parse::<f64>().unwrap()))
}

#[test]
fn a_person_who_turns_tells_where_the_sensors_stand() {
    let dir = tempfile::tempdir().unwrap();
    let subject = dir.path().join("anna");
    record(&subject, "2");
    let (take, rig) = (subject.join("takes/00-body.mcap"), dir.path().join("rig.toml"));
    fs::write(&rig, RIG).unwrap();
    exits(0, toile().arg("calibrate").arg(&rig).arg("--take").arg(&take));
    let text = fs::read_to_string(&rig).unwrap();
    assert!(text.starts_with("# ours\n") && text.contains("device = \"kinect2:B\"\nname = \"camera-2\""), "{text}");
    let turn = numbers(&text, "rotation").map(f64::to_radians);
    let off = Isometry3::new(numbers(&text, "position"), turn).inverse() * truth(&subject);
    let (shift, angle) = (off.translation.vector.norm(), off.rotation.angle().to_degrees());
    assert!(shift < 0.003 && angle < 0.2, "{shift} m, {angle}°");
    // The scan of a rig is the same for any number of threads.
    let outs = ["1", "2"].map(|threads| {
        let out = dir.path().join(threads);
        exits(0, toile().arg("fuse").arg(&take).arg("--out").arg(&out).args(["--threads", threads]));
        ["scan.ply", "trajectory.tum", "report.json"].map(|name| fs::read(out.join(name)).unwrap())
    });
    assert!(outs[0] == outs[1], "one and two threads differ");
    let trajectory = String::from_utf8(outs[0][1].clone()).unwrap();
    assert_eq!(trajectory.lines().filter(|l| l.starts_with("# sensor")).count(), 2, "{trajectory}");
}

#[test]
fn real_pairs_of_pictures_become_a_stereo_calibration() {
    let Some(folder) = toile_outside::data("real/stereo/opencv_stereo_chessboard") else { return };
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("stereo.yml");
    let side = |name: &str| {
        let numbers = (1..=14).filter(|k| *k != 10);
        numbers.map(|k| folder.join(format!("{name}{k:02}.jpg"))).collect::<Vec<_>>()
    };
    let mut command = toile();
    command.arg("calibrate").arg(&out).args(["--board", "9x6,25", "--left"]).args(side("left"));
    exits(0, command.arg("--right").args(side("right")));
    let text = fs::read_to_string(&out).unwrap();
    let t = text.split("T: !!opencv-matrix").nth(1).unwrap().split(['[', ']']).nth(1).unwrap();
    let baseline = t.split(',').map(|n| n.trim().parse::<f64>().unwrap().powi(2)).sum::<f64>().sqrt();
    assert!((baseline / 0.025 - 3.33).abs() < 0.03, "{baseline}");
}

#[test]
fn what_cannot_be_calibrated_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let (one, rig) = (dir.path().join("one"), dir.path().join("rig.toml"));
    exits(0, toile().arg("synthesize").arg("--out").arg(&one).args(["--garments", "", "--frames", "4"]));
    let take = one.join("takes/00-body.mcap");
    fs::write(&rig, RIG).unwrap();
    let said = |words: &[&str], code: i32| {
        let mut command = toile();
        command.arg("calibrate").arg(&rig).arg("--take").arg(&take).args(words);
        exits(code, &mut command).to_string()
    };
    assert!(said(&[], 1).contains("has one sensor"));
    assert!(said(&["--board", "9x6,80"], 1).contains("sees the board in 0 pictures"));
    assert!(said(&["--board", "7x10,80,60,DICT_5X5_100"], 1).contains("sees the board in 0 pictures"));
    assert!(said(&["--board", "7x10,80,60,DICT_9X9_100"], 2).contains("is no dictionary"));
    assert!(said(&["--board", "9"], 2).contains("is no board"));
    exits(2, toile().arg("calibrate").arg(&rig));
    assert_eq!(fs::read_to_string(&rig).unwrap(), RIG);
    fs::remove_file(&rig).unwrap();
    assert!(said(&[], 1).contains("rig.toml"));
}
