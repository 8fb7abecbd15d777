//! The measurements against what they must be: scale, symmetry, and each other.

mod common;

use nalgebra::{Point3, Vector3};
use toile_character::{BodyModel, Pose, SkinnedMesh};
use toile_fitting::{MeasureKind, MeasureTable, Measurements, measure, measure::stature, measure_table};
use toile_geometry::Mesh;

fn basic(model: &BodyModel, body: &SkinnedMesh) -> Measurements {
    let mesh = body.posed_mesh(&Pose::identity());
    measure(&mesh, &model.inner, stature(&mesh, &model.inner))
}

fn table(model: &BodyModel, body: &SkinnedMesh) -> MeasureTable {
    measure_table(model, body, &basic(model, body)).expect("a body of the model")
}

#[test]
fn every_measure_grows_with_the_body() {
    let model = BodyModel::load_default().unwrap();
    let body = model.skinned(&common::person(&model, 31, 0.0).beta);
    let mut larger = body.clone();
    larger.mesh.positions.iter_mut().for_each(|p| *p *= 1.25);
    larger.skeleton.rest.iter_mut().for_each(|p| *p *= 1.25);
    let (small, large) = (table(&model, &body), table(&model, &larger));
    assert_eq!(small.measures.len(), large.measures.len());
    assert!(small.measures.len() > 45, "{}", small.measures.len());
    for (a, b) in small.measures.iter().zip(&large.measures) {
        assert_eq!(a.name, b.name);
        // levels of the trunk's girths are 5 mm apart whatever the size
        let tolerance = if a.name.contains("waist") || a.name.contains("hip") { 0.006 } else { 0.001 };
        assert!((b.value_m - 1.25 * a.value_m).abs() < tolerance, "{}: {} and {}", a.name, a.value_m, b.value_m);
        assert!(!a.path.is_empty() && a.value_m > 0.02, "{}", a.name);
    }
    assert!((large.volume_l - 1.25f64.powi(3) * small.volume_l).abs() < 0.01 * large.volume_l);
}

#[test]
fn left_and_right_of_a_mirrored_body_change_places() {
    let model = BodyModel::load_default().unwrap();
    let body = model.skinned(&common::person(&model, 32, 0.0).beta);
    let plain = table(&model, &body);
    for left in plain.measures.iter().filter(|m| m.name.starts_with("left")) {
        let right = plain.value(&left.name.replace("left", "right")).unwrap();
        // the template is symmetric, people nearly so
        assert!((left.value_m - right).abs() < 0.01, "{}: {} and {right}", left.name, left.value_m);
    }
}

#[test]
fn the_mean_body_measures_like_a_person() {
    let model = BodyModel::load_default().unwrap();
    let table = table(&model, &model.skinned(&[]));
    let value = |name: &str| table.value(name).unwrap_or_else(|| panic!("{name} is missing"));
    let tall = value("stature");
    // parts of the stature that adults have (ANSUR II, both sexes), generously
    for (name, least, most) in [
        ("back neck height", 0.81, 0.89),
        ("shoulder height", 0.77, 0.86),
        ("crotch height (inside leg length)", 0.42, 0.50),
        ("knee height", 0.24, 0.31),
        ("left arm length", 0.29, 0.38),
        ("left foot length", 0.13, 0.17),
        ("shoulder breadth", 0.18, 0.26),
        ("head girth", 0.29, 0.37),
        ("neck girth", 0.18, 0.25),
        ("left thigh girth", 0.28, 0.38),
        ("left calf girth", 0.18, 0.25),
        ("left ankle girth", 0.11, 0.16),
        ("left wrist girth", 0.08, 0.11),
        ("left upper arm girth", 0.16, 0.23),
        ("back neck to waist", 0.20, 0.28),
        ("left outside leg length from the trochanter", 0.48, 0.58),
    ] {
        let part = value(name) / tall;
        assert!((least..=most).contains(&part), "{name}: {:.3} m, {part:.3} of the stature", value(name));
    }
    let (arm, parts) = (value("left arm length"), value("left upper arm length") + value("left lower arm length"));
    assert!((arm - parts).abs() < 1e-9);
    assert!(value("left knee girth") < value("left mid-thigh girth"));
    let straight = value("shoulder breadth");
    assert!((straight..1.3 * straight).contains(&value("shoulder width over the back")));
}

#[test]
fn a_girths_path_is_as_long_as_it_says_and_lies_on_the_body() {
    let model = BodyModel::load_default().unwrap();
    let table = table(&model, &model.skinned(&[0.5, 1.0]));
    for m in table.measures.iter().filter(|m| m.kind == MeasureKind::Girth && m.name != "chest girth") {
        let points: Vec<Point3<f64>> = m.path.iter().map(|p| Point3::from(*p)).collect();
        let length: f64 = points.windows(2).map(|s| (s[1] - s[0]).norm()).sum();
        let slack = if ["waist girth", "hip girth"].contains(&m.name.as_str()) { 0.03 } else { 1e-6 };
        assert!((length - m.value_m).abs() < slack, "{}: {length} along the path, {}", m.name, m.value_m);
    }
    assert_eq!(table.csv().lines().count(), table.measures.len() + 2);
    assert!(table.landmarks.iter().any(|l| l.name == "back neck point" && l.position[1] > 1.2));
}

#[test]
fn what_is_no_body_is_refused() {
    let model = BodyModel::load_default().unwrap();
    let mut body = model.skinned(&[]);
    body.mesh.positions.iter_mut().for_each(|p| *p = Point3::from(Vector3::zeros()));
    assert!(measure_table(&model, &body, &Measurements::default()).is_err_and(|e| e.to_string().contains("no body")));
    body.mesh = Mesh::default();
    assert!(measure_table(&model, &body, &Measurements::default()).is_err());
}
