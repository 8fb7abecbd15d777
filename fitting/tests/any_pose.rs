//! People who stand in other ways than the A-pose: with a fifth of the surface unseen and 2 mm of noise the fit finds the
//! pose, or says that it did not.

mod common;

use common::{Numbers, motions, strangers};
use nalgebra::{UnitQuaternion, Vector3};
use toile_character::{BodyModel, Joint, Pose, SkinnedMesh};
use toile_fitting::{BodyFit, FitSettings, Verdict, fit_body};

/// Right within these, metres: the body's mean distance from the true surface, the mean over 22 joints.
const SURFACE: f64 = 0.006;
const JOINTS: f64 = 0.030;

fn turn(pose: &mut Pose, joint: Joint, axis: Vector3<f64>, degrees: f64) {
    let rotation = pose.rotation_mut(joint);
    *rotation = UnitQuaternion::from_scaled_axis(axis * degrees.to_radians()) * *rotation;
}

fn arms_up() -> Pose {
    let mut pose = Pose::identity();
    turn(&mut pose, Joint::LeftUpperArm, Vector3::z(), 110.0);
    turn(&mut pose, Joint::RightUpperArm, Vector3::z(), -110.0);
    pose
}

fn hands_before_the_face() -> Pose {
    let mut pose = Pose::identity();
    for (side, upper, lower) in
        [(1.0, Joint::LeftUpperArm, Joint::LeftLowerArm), (-1.0, Joint::RightUpperArm, Joint::RightLowerArm)]
    {
        turn(&mut pose, upper, Vector3::y() * side, -70.0);
        turn(&mut pose, upper, Vector3::x(), -25.0);
        turn(&mut pose, lower, Vector3::new(side, -1.0, 0.0).normalize().cross(&Vector3::z()), 100.0);
    }
    pose
}

fn leg_lifted() -> Pose {
    let mut pose = Pose::identity();
    turn(&mut pose, Joint::LeftUpperLeg, Vector3::x(), -85.0);
    turn(&mut pose, Joint::LeftLowerLeg, Vector3::x(), 80.0);
    pose
}

fn bow() -> Pose {
    let mut pose = Pose::identity();
    for (joint, degrees) in [(Joint::Hips, 60.0), (Joint::Spine, 15.0), (Joint::Chest, 10.0)] {
        turn(&mut pose, joint, Vector3::x(), degrees);
    }
    for leg in [Joint::LeftUpperLeg, Joint::RightUpperLeg] {
        turn(&mut pose, leg, Vector3::x(), -60.0);
    }
    pose
}

/// Distance of the surface, mean distance of the joints (metres), and the fit.
fn tried(model: &BodyModel, body: &SkinnedMesh, pose: &Pose, seed: u64) -> (f64, f64, BodyFit) {
    let mut numbers = Numbers(seed);
    let pose = motions::placed(body, pose, &mut numbers);
    let truth = body.posed_mesh(&pose);
    let scan = motions::scanned(model, &truth, &mut numbers);
    let fit = fit_body(model, &scan, &FitSettings::default(), &|_| {}).expect("a scan that can be fitted");
    let surface = strangers::one_way(model, &fit.posed_body(), &truth);
    let joints =
        common::joint_distance(&fit.pose.joint_positions(&fit.skeleton), &pose.joint_positions(&body.skeleton));
    (surface, joints, fit)
}

#[test]
fn arms_up_a_bow_a_lifted_leg_and_hands_before_the_face_are_found_and_trusted() {
    let model = BodyModel::load_default().unwrap();
    for (k, (name, pose)) in [
        ("arms up", arms_up()),
        ("hands before the face", hands_before_the_face()),
        ("a leg lifted", leg_lifted()),
        ("a bow", bow()),
    ]
    .into_iter()
    .enumerate()
    {
        let body = motions::somebody(&model, k as u64 + 1);
        let (surface, joints, fit) = tried(&model, &body, &pose, k as u64 + 5);
        assert!(surface < SURFACE && joints < JOINTS, "{name}: {surface} m, joints {joints} m, {:?}", fit.report);
        assert_eq!(fit.verdict(), Verdict::Trusted, "{name}: {:?}", fit.report);
        assert!(fit.report.converged, "{name}: {:?}", fit.report);
    }
}

#[test]
fn poses_of_real_motions_are_found_or_refused() {
    let Some(folder) = toile_outside::data("real/motion") else { return };
    let model = BodyModel::load_default().unwrap();
    let moments = motions::moments(&model, &folder, 1, 5.0);
    let mut right = 0;
    let picked = motions::diverse(&model, &moments, 6);
    for (k, &moment) in picked.iter().enumerate() {
        let body = motions::somebody(&model, k as u64 + 1);
        let (surface, joints, fit) = tried(&model, &body, &moments[moment].pose, k as u64 + 11);
        let is_right = surface < SURFACE && joints < JOINTS;
        right += usize::from(is_right);
        let name = &moments[moment].name;
        assert!(
            is_right || fit.verdict() != Verdict::Trusted,
            "{name}: {surface} m, joints {joints} m, {:?}",
            fit.report
        );
    }
    assert!(right >= 5, "{right} of {} right", picked.len());
}
