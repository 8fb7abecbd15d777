//! People of other sliders than the model's own: other seeds, wider local sliders, other poses, noise, a fifth of the
//! surface missing. They are of the same parametric family as the model's people, not real people, so the figures here are
//! lower limits of the error on real scans. `tests/data/strangers6.bin` holds the first six of the two hundred that
//! `python -m toile_body.strangers` writes; `examples/strangers.rs` runs all of them.

mod common;

use common::{Numbers, joint_distance, strangers};
use toile_character::BodyModel;
use toile_character::{Joint, JointRegressor};
use toile_fitting::{FitSettings, Verdict, fit_body, measure_table, stature};

const PEOPLE: &[u8] = include_bytes!("data/strangers6.bin");

#[test]
fn strangers_with_a_fifth_missing_are_met_and_trusted() {
    let model = BodyModel::load_default().unwrap();
    for (k, body) in strangers::read(&model, PEOPLE).iter().enumerate() {
        let mut numbers = Numbers(k as u64 * 7919 + 1);
        let pose = strangers::random_pose(body, &mut numbers, 1.0);
        let truth = body.posed_mesh(&pose);
        let scan = strangers::scanned(&model, &truth, 0.2, 0.002, &mut numbers);
        let fit = fit_body(&model, &scan, &FitSettings::default(), &|_| {}).unwrap();
        let off = strangers::surface_distance(&model, &truth, &fit.posed_body());
        let joints = joint_distance(&fit.pose.joint_positions(&fit.skeleton), &pose.joint_positions(&body.skeleton));
        assert!(off < 0.003, "person {k}: {off} m off");
        assert!(joints < 0.008, "person {k}: joints {joints} m off");
        assert_eq!(fit.verdict(), Verdict::Trusted, "person {k}: {:?}", fit.report);
        // where chance takes most of the head away, the report must say so
        let headless = fit.report.region_covered["head"] < 0.3;
        assert_eq!(headless, fit.report.notices.iter().any(|n| n.contains("head")), "person {k}: {:?}", fit.report);
    }
}

#[test]
fn one_view_of_a_kinect_v2_gives_a_body_that_is_doubted_but_near() {
    let model = BodyModel::load_default().unwrap();
    for (k, body) in strangers::read(&model, PEOPLE).iter().enumerate().take(2) {
        let mut numbers = Numbers(k as u64 * 7919 + 1);
        let pose = strangers::random_pose(body, &mut numbers, 1.0);
        let truth = body.posed_mesh(&pose);
        let front = pose.rotation(Joint::Hips) * nalgebra::Vector3::z();
        let scan = strangers::one_view(&truth, front.x.atan2(front.z), &mut numbers);
        let fit = fit_body(&model, &scan, &FitSettings::default(), &|_| {}).unwrap();
        let off = strangers::surface_distance(&model, &truth, &fit.posed_body());
        assert!(off < 0.010, "person {k}: {off} m off");
        let standing = measure_table(&model, body).unwrap().standing;
        let tall = fit.measurements.stature_m - stature(&standing, &model.inner);
        assert!(tall.abs() < 0.025, "person {k}: {tall} m too tall");
        assert_eq!(fit.verdict(), Verdict::Doubtful, "person {k}: {:?}", fit.report);
        assert!(fit.report.reasons[0].contains("the rest is estimated"), "{:?}", fit.report.reasons);
    }
}

#[test]
fn joints_by_mean_value_coordinates_and_fewer_components_are_selectable() {
    let model = BodyModel::load_default().unwrap();
    let body = &strangers::read(&model, PEOPLE)[3];
    let mut numbers = Numbers(3);
    let pose = strangers::random_pose(body, &mut numbers, 1.0);
    let truth = body.posed_mesh(&pose);
    let scan = strangers::scanned(&model, &truth, 0.0, 0.001, &mut numbers);
    let run = |components, joints| {
        let settings = FitSettings { components, joints, conform: false, ..FitSettings::default() };
        let fit = fit_body(&model, &scan, &settings, &|_| {}).unwrap();
        let off = joint_distance(&fit.pose.joint_positions(&fit.skeleton), &pose.joint_positions(&body.skeleton));
        (fit.beta.len(), 1e3 * fit.report.scan_to_model.mean_mm, 1e3 * off)
    };
    let affine = run(50, JointRegressor::Affine);
    let mean_value = run(50, JointRegressor::MeanValue);
    let seed = run(15, JointRegressor::MeanValue);
    assert_eq!((affine.0, mean_value.0, seed.0), (50, 50, 15));
    assert!(affine.2 < mean_value.2 && mean_value.2 < 20.0, "joints: {affine:?} {mean_value:?}");
    assert!(seed.1 > affine.1, "fewer components fit less well: {seed:?} {affine:?}");
}
