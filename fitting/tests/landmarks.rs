//! Landmarks: found where they are, obeyed where they are set by hand.

mod common;

use std::collections::BTreeMap;

use common::{person, scanned};
use nalgebra::Point3;
use toile_character::BodyModel;
use toile_fitting::{FitSettings, fit_body};

#[test]
fn landmarks_are_found_on_the_scan_near_the_truth() {
    let model = BodyModel::load_default().unwrap();
    let truth = person(&model, 51, 25.0);
    let scan = scanned(&model, &truth, 0.001, 51);
    let fit = fit_body(&model, &scan, &FitSettings::default(), &|_| {}).unwrap();
    assert_eq!(fit.landmarks.len(), model.landmarks.len());
    let found: Vec<_> = fit.landmarks.iter().filter(|l| l.seen > 0.5).collect();
    assert!(found.len() > 30, "{} found", found.len());
    let off = |l: &toile_fitting::ScanLandmark| {
        let vertex = model.landmark(&l.name).unwrap() as usize;
        (Point3::from(l.position).cast::<f32>() - truth.mesh.positions[vertex]).norm()
    };
    let mean = found.iter().map(|l| off(l)).sum::<f32>() / found.len() as f32;
    assert!(mean < 0.006, "landmarks are {mean} m off");
    assert!(fit.landmarks.iter().all(|l| !l.by_hand));
}

#[test]
fn the_body_passes_through_a_landmark_set_by_hand_in_the_scans_own_units() {
    let model = BodyModel::load_default().unwrap();
    let truth = person(&model, 52, 0.0);
    let mut scan = scanned(&model, &truth, 0.001, 52);
    scan.positions.iter_mut().for_each(|p| *p *= 1000.0);
    let navel = model.landmark("navel").unwrap() as usize;
    let goal = truth.mesh.positions[navel].cast::<f64>() + nalgebra::Vector3::new(0.012, 0.01, 0.0);
    let landmarks = BTreeMap::from([("navel".to_owned(), (goal * 1000.0).into())]);
    let run = |landmarks| {
        let settings = FitSettings { landmarks, ..FitSettings::default() };
        fit_body(&model, &scan, &settings, &|_| {})
    };
    let distance = |mesh: &toile_geometry::Mesh| (mesh.positions[navel].cast::<f64>() - goal).norm();
    let (free, set) = (run(BTreeMap::new()).unwrap(), run(landmarks).unwrap());
    assert!(distance(&free.posed_body()) > 0.008, "the goal lies aside");
    assert!(distance(&set.posed_body()) < 0.002, "{}", distance(&set.posed_body()));
    let landmark = set.landmarks.iter().find(|l| l.name == "navel").unwrap();
    assert!(landmark.by_hand && landmark.seen == 1.0);
    let error = run(BTreeMap::from([("nabel".to_owned(), [0.0; 3])])).unwrap_err().to_string();
    assert!(error.contains("no landmark nabel") && error.contains("navel"), "{error}");
}
