//! `toile fuse --poses`: known poses with folders and recordings, and pose files that are wrong.

#![allow(clippy::unwrap_used)] // all of it is test code

mod common;

use std::{fs, path::Path, path::PathBuf, process::Command};

use common::{Recording, exits, toile};
use serde_json::Value;

/// One line a frame, from the list of frames that have one.
fn pose_lines(frames: &[usize]) -> String {
    let line = |i: &usize| format!("{:.9} {:.3} 0 0 0 0 0 1\n", 1.0 + 0.033_333_333 * *i as f64, 0.001 * *i as f64);
    frames.iter().map(line).collect()
}

fn write(recording: &Recording, text: &str) -> PathBuf {
    let path = recording.folder().with_file_name("poses.tum");
    fs::write(&path, text).unwrap();
    path
}

fn fuse(path: &Path, poses: &Path, out: &Path, threads: &str) -> Command {
    let mut command = toile();
    command.arg("fuse").arg(path).args(["--volume", "all", "--voxel", "20", "--truncation", "70"]);
    command.arg("--poses").arg(poses).arg("--out").arg(out).args(["--threads", threads]);
    command
}

/// The stage's record and timings.
fn reported(out: &Path) -> [Value; 2] {
    ["report.json", "timings.json"].map(|name| serde_json::from_slice(&fs::read(out.join(name)).unwrap()).unwrap())
}

#[test]
fn a_folder_and_its_recording_give_the_same_scan_for_any_number_of_threads() {
    let recording = Recording::new(6, 6);
    let poses = write(&recording, &pose_lines(&[0, 1, 2, 3, 4, 5]));
    let dir = tempfile::tempdir().unwrap();
    exits(0, toile().args(recording.import("body")));
    let take = recording.subject().join("takes/00-body.mcap");
    let outs = ["folder", "take", "two"].map(|name| dir.path().join(name));
    exits(0, &mut fuse(&recording.folder(), &poses, &outs[0], "1"));
    exits(0, &mut fuse(&take, &poses, &outs[1], "1"));
    exits(0, &mut fuse(&take, &poses, &outs[2], "2"));
    let file = |out: &Path, name: &str| fs::read(out.join(name)).unwrap();
    for name in ["scan.ply", "trajectory.tum"] {
        assert!(file(&outs[0], name) == file(&outs[1], name), "{name}: folder and recording differ");
    }
    for name in ["scan.ply", "trajectory.tum", "report.json"] {
        assert!(file(&outs[1], name) == file(&outs[2], name), "{name}: one and two threads differ");
    }
    let trajectory = String::from_utf8(file(&outs[0], "trajectory.tum")).unwrap();
    let shift = |line: &str| line.split(' ').nth(1).unwrap().parse::<f64>().unwrap();
    assert_eq!(trajectory.lines().map(shift).collect::<Vec<_>>(), [0.0, 0.001, 0.002, 0.003, 0.004, 0.005]);
    let [report, timings] = reported(&outs[2]);
    assert_eq!(report["stages"]["fuse"]["result"]["truncation_mm"].as_f64().unwrap().round(), 70.0);
    let (fuse, step) = (&timings["fuse"], &timings["fuse"]["steps"]["integrate with colour"]);
    assert_eq!((&fuse["threads"], &step["count"]), (&2.into(), &6.into()), "{timings}");
    for value in [&fuse["peak_memory_bytes"], &fuse["field_bytes"], &fuse["voxels_touched_per_frame"]] {
        assert!(value.as_u64().is_some_and(|v| v > 0), "{timings}");
    }
    assert!(["median_ms", "p95_ms", "total_s", "cpu_median_ms"].iter().all(|k| step[k].is_f64()), "{step}");
}

#[test]
fn frames_without_a_pose_are_counted_and_said() {
    let recording = Recording::new(6, 0);
    let poses = write(&recording, &pose_lines(&[0, 1, 4, 5]));
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("scan");
    let answer = exits(0, &mut fuse(&recording.folder(), &poses, &out, "1"));
    assert!(answer["warnings"].to_string().contains("2 of 6 frames have no known pose"), "{answer}");
    let [report, _] = reported(&out);
    let result = &report["stages"]["fuse"]["result"];
    let left: Vec<u64> = result["dropped"].as_array().unwrap().iter().map(|d| d["index"].as_u64().unwrap()).collect();
    assert_eq!((&result["frames_fused"], left), (&4.into(), vec![2, 3]), "{result}");
}

#[test]
fn a_wrong_pose_file_is_named_with_line_and_reason() {
    let recording = Recording::new(3, 0);
    let dir = tempfile::tempdir().unwrap();
    let wrong = [
        ("# t tx ty tz\n1.0 0 0 0 0 0 1\n", "line 2: has 7 values"),
        ("1.0 0 0 0 0 0 0 1\n1.1 0 0 x 0 0 0 1\n", "line 2: `x` is not a finite number"),
        ("1.0 0 0 inf 0 0 0 1\n", "line 1: `inf` is not a finite number"),
        ("1.0 0 0 0 0 0 0 2\n", "line 1: the rotation qx qy qz qw has length 2.000"),
        ("soon 0 0 0 0 0 0 1\n", "line 1: `soon` is not a time"),
        ("# nothing\n", "does not hold a pose"),
        ("900.0 0 0 0 0 0 0 1\n", "a known pose within 5 ms"),
    ];
    for (text, reason) in wrong {
        let poses = write(&recording, text);
        let out = dir.path().join("scan");
        let answer = exits(1, &mut fuse(&recording.folder(), &poses, &out, "1"));
        let message = answer["error"]["message"].as_str().unwrap();
        assert!(message.contains(reason), "{message}");
        assert!(!out.join("scan.ply").exists(), "nothing is written");
    }
    let missing = dir.path().join("absent.tum");
    let answer = exits(1, &mut fuse(&recording.folder(), &missing, &dir.path().join("scan"), "1"));
    assert!(answer["error"]["message"].as_str().unwrap().contains("absent.tum"), "{answer}");
}

#[test]
fn a_truncation_of_less_than_two_voxels_is_refused() {
    let recording = Recording::new(1, 0);
    for truncation in ["7.9", "nan", "1e9"] {
        let words = ["--voxel", "4", "--truncation", truncation];
        let answer = exits(2, toile().arg("fuse").arg(recording.folder()).args(words));
        assert!(answer["error"]["message"].as_str().unwrap().contains("--truncation"), "{answer}");
    }
}
