//! Commands on single scans and recordings, ours and other people's.

#![allow(clippy::unwrap_used)] // all of it is test code

mod common;

use std::{
    fs,
    path::{Path, PathBuf},
};

use common::{exits, toile};
use serde::Deserialize;
use serde_json::Value;
use toile_character::{BodyModel, Joint, JointRegressor};
use toile_geometry::{Mesh, obj, ply};

fn json(path: PathBuf) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

#[test]
fn a_scan_in_millimetres_is_fitted_with_a_notice() {
    let dir = tempfile::tempdir().unwrap();
    let model = BodyModel::load_default().unwrap();
    let stature = model.mean.iter().map(|p| p.y).fold(0.0, f32::max);
    let scan = dir.path().join("somebody.obj");
    let large = model.mean.iter().map(|p| p * 1000.0).collect();
    obj::write(&scan, &Mesh::new(large, model.triangles.clone())).unwrap();
    let out = dir.path().join("fitted");
    let answer = exits(0, toile().arg("fit").arg("--scan").arg(&scan).arg("--out").arg(&out));
    assert!(answer["warnings"].to_string().contains("millimetres"), "{answer}");
    let found = json(out.join("body.json"))["stature_m"].as_f64().unwrap();
    assert!((found - f64::from(stature)).abs() < 0.01, "{found} m, not {stature} m");
    for file in ["body.ply", "model.ply", "rest.ply", "rigged_scan.glb", "pose.json", "report.json"] {
        assert!(out.join(file).is_file(), "{file}");
    }
}

/// The model's own mean body as somebody's scan.
fn somebody(folder: &Path) -> PathBuf {
    let model = BodyModel::load_default().unwrap();
    let scan = folder.join("somebody.ply");
    ply::write(&scan, &Mesh::new(model.mean.clone(), model.triangles)).unwrap();
    scan
}

#[test]
fn a_scan_is_measured_into_a_table() {
    let dir = tempfile::tempdir().unwrap();
    let (scan, out) = (somebody(dir.path()), dir.path().join("measured"));
    let answer = exits(0, toile().arg("measure").arg("--scan").arg(&scan).arg("--out").arg(&out));
    let waist = answer["results"]["measurements_m"]["waist girth"].as_f64().unwrap();
    let csv = fs::read_to_string(out.join("measurements.csv")).unwrap();
    assert!(csv.starts_with("measurement,kind,value,unit,height,definition,uncertainty,seen,doubt\n"), "{csv}");
    let line: Vec<&str> = csv.lines().find(|l| l.starts_with("waist girth")).unwrap().split(',').collect();
    assert_eq!((line[1], line[3]), ("girth", "cm"));
    assert!((line[2].parse::<f64>().unwrap() - 100.0 * waist).abs() < 0.06, "{line:?}");
    assert!((80.0..130.0).contains(&line[4].parse::<f64>().unwrap()), "{line:?}");
}

#[test]
fn what_is_said_by_hand_of_a_body_is_heeded() {
    let dir = tempfile::tempdir().unwrap();
    let (scan, out, edits) = (somebody(dir.path()), dir.path().join("fitted"), dir.path().join("body.json"));
    let fit = || {
        let mut command = toile();
        command.arg("fit").arg("--scan").arg(&scan).arg("--out").arg(&out).arg("--edits").arg(&edits);
        command
    };
    let model = BodyModel::load_default().unwrap();
    let navel = model.mean[model.landmark("navel").unwrap() as usize];
    let goal = [f64::from(navel.x), f64::from(navel.y) + 0.01, f64::from(navel.z) + 0.005];
    let said = serde_json::json!({
        "version": 1, "dressed": true, "components": 15, "joints": "mean-value", "landmarks": { "navel": goal }
    });
    fs::write(&edits, said.to_string()).unwrap();
    let answer = exits(0, &mut fit());
    assert!(answer["warnings"].to_string().contains("dressed"), "{answer}");
    let body = json(out.join("body.json"));
    assert_eq!(body["beta"].as_array().map(Vec::len), Some(15));
    assert_eq!(body["report"]["estimated"], true);
    let skin = ply::read(&out.join("body.ply")).unwrap().positions[model.landmark("navel").unwrap() as usize];
    assert!((skin.z - goal[2] as f32).abs() < 0.002 && (skin.y - goal[1] as f32).abs() < 0.002, "{skin}");
    let joint = |name: &str| Vec::<f64>::deserialize(&body["rest_joints"][name]).unwrap();
    let beta = Vec::<f64>::deserialize(&body["beta"]).unwrap();
    let expected = model.skeleton_by(&beta, JointRegressor::MeanValue).position(Joint::LeftHand);
    assert!((joint("leftHand")[0] - expected.x).abs() < 1e-6, "{:?}, not {expected}", joint("leftHand"));
    for (text, says) in [
        (r#"{"version": 1, "landmarks": {"navel": [0, 3, 0]}}"#, "navel is more than 30 mm"),
        (r#"{"version": 1, "landmarks": {"nabel": [0, 1, 0]}}"#, "no landmark nabel"),
        (r#"{"version": 1, "joint": "affine"}"#, "joint"),
        (r#"{"version": 2}"#, "version 2"),
    ] {
        fs::write(&edits, text).unwrap();
        let answer = exits(1, &mut fit());
        assert!(answer["error"]["message"].as_str().unwrap().contains(says), "{answer}");
    }
}

#[test]
fn a_mesh_without_a_person_and_a_file_without_a_mesh_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let corners =
        (0..8).map(|i| [0.9 * (i & 1) as f32, 1.1 * (i >> 1 & 1) as f32, 0.8 * (i >> 2) as f32].into()).collect();
    let faces = [
        [0, 2, 1],
        [1, 2, 3],
        [4, 5, 6],
        [5, 7, 6],
        [0, 1, 4],
        [1, 5, 4],
        [2, 6, 3],
        [3, 6, 7],
        [0, 4, 2],
        [2, 4, 6],
        [1, 3, 5],
        [3, 7, 5],
    ];
    let (chest, torn) = (dir.path().join("chest.ply"), dir.path().join("torn.ply"));
    ply::write(&chest, &Mesh::new(corners, faces.to_vec())).unwrap();
    let bytes = fs::read(&chest).unwrap();
    fs::write(&torn, &bytes[..bytes.len() - 20]).unwrap();
    for scan in [&chest, &torn] {
        let out = dir.path().join("out");
        let answer = exits(1, toile().arg("fit").arg("--scan").arg(scan).arg("--out").arg(&out));
        let message = answer["error"]["message"].as_str().unwrap();
        assert!(message.contains(scan.file_name().unwrap().to_str().unwrap()), "{message}");
        assert!(!out.exists(), "nothing is written");
    }
}

#[test]
fn a_room_seen_by_a_hand_held_camera_is_fused_whole() {
    let Some(room) = toile_outside::data("real/rgbd/sevenscenes_kitchen_a") else { return };
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("room");
    let words = ["--volume", "all", "--prior", "none", "--voxel", "10"];
    exits(0, toile().arg("fuse").arg(room).args(words).arg("--out").arg(&out));
    let scan = ply::read(&out.join("scan.ply")).unwrap();
    let (low, high) = scan.bounds().unwrap();
    assert!(scan.triangles.len() > 10_000 && (high - low).max() > 2.0, "{} triangles", scan.triangles.len());
}

#[test]
fn a_real_person_turning_is_imported_and_the_turn_closes() {
    let Some(person) = toile_outside::data("real/rgbd/uva_cv2_person_turn") else { return };
    let dir = tempfile::tempdir().unwrap();
    let subject = dir.path().join("person");
    exits(0, toile().arg("import").arg(person).arg("--subject").arg(&subject).args(["--layer", "body"]));
    exits(0, toile().arg("fuse").arg(&subject));
    let report = json(subject.join("build/00-body/report.json"));
    let fused = &report["stages"]["fuse"]["result"];
    assert_eq!((&fused["frames_fused"], &fused["full_turn"]), (&100.into(), &true.into()), "{fused}");
    assert!(fused["seam_after_mm"].as_f64().unwrap() < 5.0, "{fused}");
}
