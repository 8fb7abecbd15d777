//! Scans that do not show a standing person: the verdict says so and what to do.

mod common;

use common::{Numbers, cuboid, finer, joined};
use nalgebra::{Point3, Vector3};
use toile_character::BodyModel;
use toile_fitting::{FitSettings, Verdict, fit_body};
use toile_geometry::Mesh;

/// An ellipsoid, outward, with some noise.
fn ellipsoid(center: [f32; 3], radii: [f32; 3], seed: u64) -> Mesh {
    let mut numbers = Numbers(seed);
    let mut mesh = finer(&cuboid([-1.0; 3], [1.0; 3]), 5);
    for p in &mut mesh.positions {
        let n = p.coords.normalize();
        let r = 1.0 + 0.01 * numbers.next() as f32;
        *p = Point3::from(Vector3::from(center) + n.component_mul(&Vector3::from(radii)) * r);
    }
    mesh
}

#[test]
fn a_cat_is_refused() {
    let model = BodyModel::load_default().unwrap();
    let leg = |x: f32, z: f32| ellipsoid([x, 0.08, z], [0.025, 0.09, 0.025], 3);
    let cat = joined(&[
        ellipsoid([0.0, 0.2, 0.0], [0.2, 0.08, 0.08], 1),
        ellipsoid([0.24, 0.28, 0.0], [0.06, 0.06, 0.05], 2),
        leg(0.14, 0.04),
        leg(0.14, -0.04),
        leg(-0.14, 0.04),
        leg(-0.14, -0.04),
        ellipsoid([-0.27, 0.3, 0.0], [0.02, 0.12, 0.02], 4),
    ]);
    let fit = fit_body(&model, &cat, &FitSettings::default(), &|_| {}).unwrap();
    assert_eq!(fit.verdict(), Verdict::Failed, "{:?}", fit.report);
    assert!(fit.report.reasons.iter().any(|r| r.contains("tall") || r.contains("person")), "{:?}", fit.report.reasons);
}

#[test]
fn a_wall_and_a_ball_are_refused() {
    let model = BodyModel::load_default().unwrap();
    for scan in [finer(&cuboid([0.0; 3], [1.5, 1.8, 0.02]), 5), ellipsoid([0.0, 0.9, 0.0], [0.9; 3], 5)] {
        let fit = fit_body(&model, &scan, &FitSettings::default(), &|_| {}).unwrap();
        assert_eq!(fit.verdict(), Verdict::Failed, "{:?}", fit.report);
        assert!(!fit.report.reasons.is_empty());
    }
}

/// A flat figure like a gingerbread man.
fn flat_figure() -> Mesh {
    let leg = |x: f32| cuboid([x - 0.09, 0.0, -0.03], [x + 0.09, 0.8, 0.03]);
    joined(&[
        cuboid([-0.22, 0.67, -0.03], [0.22, 1.42, 0.03]),
        cuboid([-0.65, 1.17, -0.03], [0.65, 1.33, 0.03]),
        ellipsoid([0.0, 1.55, 0.0], [0.18, 0.18, 0.03], 6),
        leg(-0.14),
        leg(0.14),
    ])
}

fn horse() -> Mesh {
    let leg = |x: f32, z: f32| ellipsoid([x, 0.45, z], [0.07, 0.47, 0.07], 8);
    joined(&[
        ellipsoid([0.0, 1.1, 0.0], [0.75, 0.3, 0.28], 7),
        ellipsoid([0.8, 1.55, 0.0], [0.16, 0.45, 0.13], 9),
        ellipsoid([1.0, 1.85, 0.0], [0.3, 0.12, 0.1], 10),
        leg(0.5, 0.15),
        leg(0.5, -0.15),
        leg(-0.5, 0.15),
        leg(-0.5, -0.15),
    ])
}

#[test]
fn what_is_not_a_person_is_refused_even_where_clothes_are_expected() {
    let model = BodyModel::load_default().unwrap();
    let shapes = [
        ("a box", finer(&cuboid([-0.25, 0.0, -0.15], [0.25, 1.7, 0.15]), 5)),
        ("a thick column", ellipsoid([0.0, 0.87, 0.0], [0.25, 0.9, 0.25], 11)),
        ("a thin column", finer(&cuboid([-0.09, 0.0, -0.09], [0.09, 1.7, 0.09]), 5)),
        ("a flat figure", finer(&flat_figure(), 2)),
        ("a horse", horse()),
        ("a ball", ellipsoid([0.0, 0.85, 0.0], [0.85; 3], 12)),
    ];
    for (name, scan) in shapes {
        let settings = FitSettings { dressed: true, ..FitSettings::default() };
        let fit = fit_body(&model, &scan, &settings, &|_| {}).unwrap();
        assert_eq!(fit.verdict(), Verdict::Failed, "{name}: {:?}", fit.report);
    }
}

#[test]
fn the_upper_half_of_a_person_is_not_trusted() {
    let model = BodyModel::load_default().unwrap();
    let whole = common::scanned(&model, &common::person(&model, 21, 40.0), 0.001, 21);
    let is_upper = |t: usize| whole.triangles[t].iter().all(|&v| whole.positions[v as usize].y > 0.95);
    let (upper, _) = whole.filter_triangles(is_upper);
    let fit = fit_body(&model, &upper, &FitSettings::default(), &|_| {}).unwrap();
    assert_ne!(fit.verdict(), Verdict::Trusted, "{:?}", fit.report);
    assert!(!fit.report.reasons.is_empty());
}
