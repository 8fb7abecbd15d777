//! Landmarks: found where they are, obeyed where they are set by hand.

mod common;

use std::collections::BTreeMap;

use common::{person, scanned};
use nalgebra::{Point3, UnitQuaternion, Vector3};
use toile_character::{BodyModel, Joint};
use toile_fitting::{FitSettings, fit_body};
use toile_geometry::Mesh;

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

/// Joint errors with and without landmarks of a person who stands in `turns` (joint, rotation vector in radians).
fn errors_with_and_without(seed: u64, turns: &[(Joint, [f64; 3])], names: &[&str]) -> (f64, f64) {
    let model = BodyModel::load_default().expect("the body ships with the crate");
    let mut truth = person(&model, seed, 0.0);
    for (joint, turn) in turns {
        *truth.pose.rotation_mut(*joint) = UnitQuaternion::from_scaled_axis(Vector3::from(*turn));
    }
    truth.mesh = Mesh::new(model.posed(&truth.beta, &truth.pose), model.triangles.clone());
    truth.mesh.recompute_normals();
    let scan = scanned(&model, &truth, 0.001, seed);
    let at = |name: &&str| {
        truth.mesh.positions[model.landmark(name).expect("a landmark of the model") as usize].cast::<f64>().into()
    };
    let landmarks: BTreeMap<String, [f64; 3]> = names.iter().map(|n| ((*n).to_owned(), at(n))).collect();
    let error = |landmarks| {
        let fit =
            fit_body(&model, &scan, &FitSettings { landmarks, ..FitSettings::default() }, &|_| {}).expect("a person");
        let (found, true_ones) =
            (fit.pose.joint_positions(&fit.skeleton), truth.pose.joint_positions(&model.skeleton_at(&truth.beta)));
        found.iter().zip(&true_ones).take(22).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    };
    (error(BTreeMap::new()), error(landmarks))
}

#[test]
fn arms_behind_the_back_are_put_right_by_four_landmarks_and_a_squat_needs_none() {
    let thighs = [(Joint::LeftUpperLeg, [-1.8, 0.0, 0.0]), (Joint::RightUpperLeg, [-1.8, 0.0, 0.0])];
    let shins = [(Joint::LeftLowerLeg, [2.0, 0.0, 0.0]), (Joint::RightLowerLeg, [2.0, 0.0, 0.0])];
    let squat = [thighs, shins].concat();
    let behind = [
        (Joint::LeftUpperArm, [0.7, 0.4, -0.5]),
        (Joint::LeftLowerArm, [1.0, 0.9, 0.0]),
        (Joint::RightUpperArm, [0.7, -0.4, 0.5]),
        (Joint::RightLowerArm, [1.0, -0.9, 0.0]),
    ];
    let legs = ["leftKneeFront", "leftAnkleOuter", "rightKneeFront", "rightAnkleOuter"];
    let arms = ["leftElbow", "leftWristBack", "rightElbow", "rightWristBack"];
    for (turns, names, is_found) in [(&squat[..], legs, true), (&behind[..], arms, false)] {
        let (free, set) = errors_with_and_without(71, turns, &names);
        assert!(
            (free < 0.03) == is_found && set < 0.015,
            "joints are {free} m off without {names:?}, {set} m with them"
        );
    }
}

#[test]
fn landmarks_on_a_lifted_leg_keep_the_person_upright() {
    let turns = [(Joint::LeftUpperLeg, [-1.4, 0.0, 0.0]), (Joint::LeftLowerLeg, [1.5, 0.0, 0.0])];
    let names = ["leftKneeFront", "leftAnkleOuter", "leftHeel", "leftToeTip"];
    let (_, set) = errors_with_and_without(71, &turns, &names);
    assert!(set < 0.01, "joints are {set} m off");
}
