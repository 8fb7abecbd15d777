//! The body fit against people of known shape and pose, and against scans that do not show a person.

mod common;

use common::{cuboid, finer, joined, joint_distance, mean_distance, person, scanned};
use nalgebra::{UnitQuaternion, Vector3};
use toile_character::BodyModel;
use toile_fitting::{BodyFit, FitSettings, FittingError, Verdict, fit_body};
use toile_geometry::Mesh;

fn fit(model: &BodyModel, scan: &Mesh) -> Result<BodyFit, FittingError> {
    fit_body(model, scan, &FitSettings::default(), &|_| {})
}

#[test]
fn shape_and_pose_are_recovered_from_a_noisy_scan_at_any_heading() {
    let model = BodyModel::load_default().unwrap();
    for (seed, heading) in [(1, 0.0), (2, 170.0), (3, -75.0)] {
        let truth = person(&model, seed, heading);
        let fit = fit(&model, &scanned(&model, &truth, 0.0015, seed)).unwrap();
        let joints = joint_distance(
            &fit.pose.joint_positions(&fit.skeleton),
            &truth.pose.joint_positions(&model.skeleton_at(&truth.beta)),
        );
        let (model_error, body_error) = (
            mean_distance(&fit.model_mesh.positions, &truth.mesh.positions),
            mean_distance(&fit.posed_body().positions, &truth.mesh.positions),
        );
        assert_eq!(fit.verdict(), Verdict::Trusted, "{:?}", fit.report);
        assert!(model_error < 0.004, "seed {seed}: the model is {model_error} m off");
        assert!(body_error < 0.004, "seed {seed}: the body is {body_error} m off");
        assert!(joints < 0.006, "seed {seed}: joints are {joints} m off");
        assert!(fit.report.scan_to_body.mean_mm < 1.6, "{:?}", fit.report);
        assert!(fit.report.notices.is_empty() && fit.mend.is_identity());
    }
}

#[test]
fn millimetres_and_a_lying_scan_are_mended_with_a_notice() {
    let model = BodyModel::load_default().unwrap();
    let truth = person(&model, 4, 30.0);
    let upright = scanned(&model, &truth, 0.001, 4);
    let lay = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f32::consts::FRAC_PI_2);
    let mut scan = upright.clone();
    scan.positions.iter_mut().for_each(|p| *p = lay * (*p * 1000.0));
    let fit = fit(&model, &scan).unwrap();
    assert_eq!(fit.report.notices.len(), 2, "{:?}", fit.report.notices);
    assert_eq!(fit.verdict(), Verdict::Trusted, "{:?}", fit.report);
    let mended = fit.mend.apply(&scan);
    assert!(mean_distance(&mended.positions, &upright.positions) < 1e-4);
    assert!(mean_distance(&fit.posed_body().positions, &truth.mesh.positions) < 0.004);
}

#[test]
fn upside_down_is_recognised() {
    let model = BodyModel::load_default().unwrap();
    let truth = person(&model, 5, 0.0);
    let mut scan = scanned(&model, &truth, 0.001, 5);
    scan.positions.iter_mut().for_each(|p| (p.y, p.z) = (-p.y, -p.z));
    let fit = fit(&model, &scan).unwrap();
    assert_eq!(fit.verdict(), Verdict::Trusted, "{:?}", fit.report);
    assert!((fit.mend.rotation * Vector3::y()).y < -0.99);
}

#[test]
fn a_chair_and_two_people_are_not_trusted() {
    let model = BodyModel::load_default().unwrap();
    let leg = |x: f32, z: f32| cuboid([x, 0.0, z], [x + 0.04, 0.45, z + 0.04]);
    let chair = joined(&[
        cuboid([0.0, 0.45, 0.0], [0.45, 0.49, 0.45]),
        cuboid([0.0, 0.49, 0.0], [0.45, 0.95, 0.03]),
        leg(0.0, 0.0),
        leg(0.41, 0.0),
        leg(0.0, 0.41),
        leg(0.41, 0.41),
    ]);
    let fit_of_chair = fit(&model, &finer(&chair, 5)).unwrap();
    assert_ne!(fit_of_chair.verdict(), Verdict::Trusted, "{:?}", fit_of_chair.report);
    let one = person(&model, 6, 0.0).mesh;
    let mut other = person(&model, 7, 20.0).mesh;
    other.positions.iter_mut().for_each(|p| p.x += 1.1);
    let fit_of_two = fit(&model, &joined(&[one, other])).unwrap();
    assert_eq!(fit_of_two.verdict(), Verdict::Failed, "{:?}", fit_of_two.report);
    assert!(fit_of_two.report.reasons[0].contains("one standing person"), "{:?}", fit_of_two.report.reasons);
}

#[test]
fn nonsense_is_refused_with_a_sentence() {
    let model = BodyModel::load_default().unwrap();
    let refused = |scan: &Mesh| fit(&model, scan).unwrap_err().to_string();
    assert!(refused(&Mesh::default()).contains("no triangles"));
    assert!(refused(&cuboid([0.0; 3], [0.02; 3])).contains("not the size of a person"));
    let mut broken = cuboid([0.0; 3], [1.0; 3]);
    broken.positions[3].y = f32::NAN;
    assert!(refused(&broken).contains("not finite"));
    let settings = FitSettings { components: 0, ..FitSettings::default() };
    let error = fit_body(&model, &cuboid([0.0; 3], [1.0; 3]), &settings, &|_| {}).unwrap_err();
    assert!(error.to_string().contains("components"));
}

#[test]
fn one_and_two_threads_give_the_same_bits() {
    let model = BodyModel::load_default().unwrap();
    let scan = scanned(&model, &person(&model, 8, 100.0), 0.001, 8);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let fit = pool.install(|| fit(&model, &scan)).unwrap();
        serde_json::to_string(&fit.summary()).unwrap() + &format!("{:?}", fit.body.mesh.positions)
    };
    assert_eq!(run(1), run(2));
}

#[test]
fn the_conformed_body_is_closed_and_has_no_folds() {
    let model = BodyModel::load_default().unwrap();
    let fit = fit(&model, &scanned(&model, &person(&model, 9, 0.0), 0.0015, 9)).unwrap();
    let body = fit.posed_body();
    assert_eq!(body.triangles, model.triangles);
    let (before, after) = (fit.model_mesh.triangle_normals(), body.triangle_normals());
    let folds = before.iter().zip(&after).filter(|(a, b)| a.dot(b) < 0.0).count();
    assert_eq!(folds, 0);
}
