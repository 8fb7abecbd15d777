//! Archives without an undressed take: the body is estimated from a dressed scan, and said to be.

mod common;

use common::{joint_distance, person, strangers::surface_distance};
use toile_character::{BodyModel, Region};
use toile_fitting::{FitSettings, Verdict, fit_body};

#[test]
fn a_body_is_estimated_under_clothes_and_flagged() {
    let model = BodyModel::load_default().unwrap();
    for seed in [61, 62] {
        let truth = person(&model, seed, 40.0);
        let mut scan = truth.mesh.clone();
        for v in 0..scan.positions.len() {
            if !matches!(
                model.regions[v],
                Region::Head | Region::LeftHand | Region::RightHand | Region::LeftFoot | Region::RightFoot
            ) {
                let p = scan.positions[v];
                // tight here, wide there
                let stand_off = 0.016 * (1.0 + (17.0 * p.y).sin() * (23.0 * p.x + 9.0 * p.z).cos());
                scan.positions[v] += scan.normals[v] * stand_off;
            }
        }
        let run =
            |dressed| fit_body(&model, &scan, &FitSettings { dressed, ..FitSettings::default() }, &|_| {}).unwrap();
        let (fit, naive) = (run(true), run(false));
        let off = |fit: &toile_fitting::BodyFit| surface_distance(&model, &truth.mesh, &fit.posed_body());
        assert!(off(&fit) < 0.7 * off(&naive), "seed {seed}: {} against {} m", off(&fit), off(&naive));
        assert!(off(&fit) < 0.010, "seed {seed}: {} m", off(&fit));
        let joints = joint_distance(
            &fit.pose.joint_positions(&fit.skeleton),
            &truth.pose.joint_positions(&model.skeleton_at(&truth.beta)),
        );
        assert!(joints < 0.02, "seed {seed}: {joints}");
        assert_eq!(fit.verdict(), Verdict::Doubtful, "{:?}", fit.report);
        assert!(fit.report.estimated && fit.report.reasons.iter().any(|r| r.contains("estimated")));
        assert!(!naive.report.estimated);
    }
}
