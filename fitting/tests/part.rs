//! Scans of the upper part of a person: fitted and said to be one, or refused as too little; and the bare skin of the dressed.

#![allow(clippy::unwrap_used)] // all of it is test code

mod common;

use common::{person, strangers::one_way};
use toile_character::{BodyModel, Region};
use toile_fitting::{BodyFit, FitSettings, Verdict, fit_body, measure_table, take_on_bare_skin};
use toile_geometry::Mesh;

/// A person's surface above `share` of the stature.
fn above(mesh: &Mesh, share: f32) -> Mesh {
    let (low, high) = mesh.bounds().unwrap();
    let cut = low.y + share * (high.y - low.y);
    mesh.filter_triangles(|t| mesh.corners(t).iter().all(|p| p.y > cut)).0
}

fn fitted(model: &BodyModel, scan: &Mesh, dressed: bool) -> BodyFit {
    fit_body(model, scan, &FitSettings { dressed, ..FitSettings::default() }, &|_| {}).unwrap()
}

#[test]
fn an_upper_half_is_fitted_and_said_to_be_one() {
    let model = BodyModel::load_default().unwrap();
    let truth = person(&model, 71, 100.0);
    let scan = above(&truth.mesh, 0.52);
    let fit = fitted(&model, &scan, false);
    let part = fit.report.part.as_ref().expect("it is a part of a person");
    assert!(["hips", "waist"].contains(&part.from.as_str()) && part.covered > 0.9, "{part:?}");
    assert_eq!(fit.verdict(), Verdict::Doubtful, "{:?}", fit.report.reasons);
    assert!(fit.report.reasons.iter().any(|r| r.contains("shows a person from the")), "{:?}", fit.report.reasons);
    let off = one_way(&model, &scan, &fit.posed_body());
    assert!(off < 0.002, "the scan lies {off} m from the body");

    let table = measure_table(&model, &fit.body).unwrap().of_fit(&fit);
    let find = |name: &str| table.measures.iter().find(|m| m.name == name).unwrap();
    for (name, is_seen) in [("stature", false), ("knee height", false), ("bust girth", true)] {
        let Some(measure) = table.measures.iter().find(|m| m.name.ends_with(name)) else { panic!("{name} is missing") };
        let doubt = measure.doubt.as_deref().unwrap_or_default();
        assert_eq!(!doubt.contains("was not seen"), is_seen, "{name}: {doubt}");
    }
    let stature = find("stature");
    assert!(stature.uncertainty_m.unwrap() > 0.1 && !stature.is_measured() && stature.text().contains("(?)"));
}

#[test]
fn a_bust_gets_no_body_and_is_told_what_it_is() {
    let model = BodyModel::load_default().unwrap();
    let scan = above(&person(&model, 72, 30.0).mesh, 0.80);
    let fit = fitted(&model, &scan, false);
    assert!(fit.verdict() == Verdict::Failed && fit.report.is_too_little, "{:?}", fit.report);
    assert!(fit.report.reasons[0].contains("too little for a body"), "{:?}", fit.report.reasons);
}

#[test]
fn the_dressed_take_on_what_is_bare_and_stay_inside_what_is_not() {
    let model = BodyModel::load_default().unwrap();
    let truth = person(&model, 73, 0.0);
    let mut scan = truth.mesh.clone();
    let is_cloth: Vec<bool> = model.regions.iter().map(|r| *r == Region::Torso).collect();
    for v in (0..scan.positions.len()).filter(|&v| is_cloth[v]) {
        scan.positions[v] += scan.normals[v] * 0.012;
    }
    // a nose that no model has
    let nose = model.landmark("noseTip").unwrap();
    let tip = scan.positions[nose as usize];
    for v in 0..scan.positions.len() {
        let near = (1.0 - (scan.positions[v] - tip).norm() / 0.03).max(0.0);
        scan.positions[v] += scan.normals[v] * 0.006 * near;
    }
    let settings = FitSettings { dressed: true, ..FitSettings::default() };
    let fit = fitted(&model, &scan, true);
    let before = fit.report.scan_to_body.mean_mm;
    let at = |fit: &BodyFit| fit.posed_body().positions[nose as usize];
    let nose_before = (at(&fit) - scan.positions[nose as usize]).norm();
    let bare = take_on_bare_skin(&model, fit, &scan, &is_cloth, &settings).unwrap();
    assert!(bare.report.scan_to_body.mean_mm < 2.0_f64.min(before), "{:?} {before}", bare.report.scan_to_body);
    let nose_after = (at(&bare) - scan.positions[nose as usize]).norm();
    assert!(nose_after < 0.003 && nose_after < nose_before, "the nose is {nose_after} m off, {nose_before} before");
    let seen_torso = (0..is_cloth.len()).filter(|&v| is_cloth[v] && bare.seen[v]).count();
    let torso = is_cloth.iter().filter(|c| **c).count();
    assert!(20 * seen_torso < torso, "{seen_torso} of {torso} covered vertices count as seen");
    let wrong = take_on_bare_skin(&model, bare, &scan, &[true], &settings).unwrap_err().to_string();
    assert!(wrong.contains("1 labels of cloth"), "{wrong}");
}
