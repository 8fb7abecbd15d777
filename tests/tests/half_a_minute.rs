//! A take of ordinary length: half a minute at 30 frames a second. What noise leaves behind grows with the number of
//! frames; a scan must not.

#![allow(clippy::unwrap_used)] // all of it is test code

use std::{path::Path, process::Command};

use serde_json::Value;
use toile_geometry::{Mesh, ply};

/// Height over the disk below which surface is counted, metres: soles, and what would be left of the disk.
const LOW: f32 = 0.02;

fn toile(words: &[&str]) -> Value {
    let done =
        Command::new(env!("CARGO_BIN_EXE_toile-under-test")).args(words).args(["--json", "-q"]).output().unwrap();
    let answer: Value = serde_json::from_slice(&done.stdout).unwrap_or_default();
    assert_eq!(done.status.code(), Some(0), "{words:?}: {answer} {}", String::from_utf8_lossy(&done.stderr));
    answer
}

fn read(path: &Path) -> Mesh {
    ply::read(path).unwrap()
}

/// Area of the triangles that lie below a height, square metres.
fn area_below(mesh: &Mesh, height: f32) -> f64 {
    let low = |t: &usize| mesh.corners(*t).iter().all(|c| c.y < height);
    let area = |t: usize| {
        let [a, b, c] = mesh.corners(t).map(nalgebra::OPoint::cast::<f64>);
        0.5 * (b - a).cross(&(c - a)).norm()
    };
    (0..mesh.triangles.len()).filter(low).map(area).sum()
}

fn height(mesh: &Mesh) -> f32 {
    let (low, high) = mesh.bounds().unwrap();
    high.y - low.y
}

#[test]
fn nine_hundred_frames_make_the_person_and_nothing_of_the_disk() {
    let dir = tempfile::tempdir().unwrap();
    let subject = dir.path().join("nora");
    let name = subject.to_str().unwrap();
    toile(&["synthesize", "--out", name, "--garments", "", "--frames", "900", "--fps", "30"]);
    toile(&["process", name]);

    let scan = read(&subject.join("build/00-body/scan.ply"));
    let truth = read(&subject.join("truth/00-body/truth/surface.ply"));
    assert!((height(&scan) - height(&truth)).abs() < 0.008, "{} instead of {} m", height(&scan), height(&truth));
    let (low, true_low) = (area_below(&scan, LOW), area_below(&truth, LOW));
    assert!(low < 1.5 * true_low, "{low} m² below {LOW} m, but the soles have {true_low}");
    // The truth's hollow mouth and its eyes are surface that no camera sees.
    let volumes = [&scan, &truth].map(Mesh::signed_volume);
    assert!((volumes[0] / volumes[1] - 1.0).abs() < 0.02, "volumes: {volumes:?}");
    let report = std::fs::read_to_string(subject.join("build/00-body/report.json")).unwrap();
    let report: Value = serde_json::from_str(&report).unwrap();
    let fused = report["stages"]["fuse"]["result"]["frames_fused"].as_u64().unwrap();
    assert!(fused >= 890, "{fused} of 900 frames fused");
}
