//! People whom the model was not made from: other seeds and wider local sliders than its own, other poses, noise, a
//! fifth of the surface missing. `tests/data/strangers6.bin` holds the first six of the two hundred that
//! `python -m toile_body.strangers` writes; `examples/strangers.rs` runs all of them.

mod common;

use common::{Numbers, joint_distance, strangers};
use toile_character::BodyModel;
use toile_fitting::{FitSettings, Verdict, fit_body};

const PEOPLE: &[u8] = include_bytes!("data/strangers6.bin");

#[test]
fn strangers_with_a_fifth_missing_are_met_and_trusted() {
    let model = BodyModel::load_default().unwrap();
    for (k, body) in strangers::read(&model, PEOPLE).iter().enumerate() {
        let mut numbers = Numbers(k as u64 * 7919 + 1);
        let pose = strangers::stance(body, &mut numbers, 1.0);
        let truth = body.posed_mesh(&pose);
        let scan = strangers::scanned(&model, &truth, 0.2, 0.002, &mut numbers);
        let fit = fit_body(&model, &scan, &FitSettings::default(), &|_| {}).unwrap();
        let off = strangers::surface_distance(&model, &truth, &fit.posed_body());
        let joints = joint_distance(&fit.pose.joint_positions(&fit.skeleton), &pose.joint_positions(&body.skeleton));
        assert!(off < 0.003, "person {k}: {off} m off");
        assert!(joints < 0.008, "person {k}: joints {joints} m off");
        assert_eq!(fit.verdict(), Verdict::Trusted, "person {k}: {:?}", fit.report);
    }
}
