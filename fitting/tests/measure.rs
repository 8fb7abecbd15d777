//! The measurements against what they must be: scale, symmetry, each other, and the docs.

mod common;

use nalgebra::{Point3, Vector3};
use toile_character::{BodyModel, SkinnedMesh};
use toile_fitting::{MeasureTable, measure_table};
use toile_geometry::Mesh;

fn table(model: &BodyModel, body: &SkinnedMesh) -> MeasureTable {
    measure_table(model, body).expect("a body of the model")
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
    assert!(small.measures.len() > 55, "{}", small.measures.len());
    for (a, b) in small.measures.iter().zip(&large.measures) {
        assert_eq!(a.name, b.name);
        // how far a prominence is searched, and that a tape is 2 cm wide, do not grow with the body
        let is_searched = ["hip", "bust", "chest"].iter().any(|n| a.name.contains(n));
        let tolerance = if is_searched { 0.010 } else { 0.001 };
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
    let (arm, parts) = (value("left arm length"), value("left upper arm length") + value("left lower arm length"));
    assert!((arm - parts).abs() < 1e-9);
    assert!(value("left knee girth") < value("left mid-thigh girth"));
    assert!(value("left ankle girth") < value("left calf girth"));
    assert!(value("waist girth") < value("top hip girth") && value("top hip girth") < value("hip girth"));
    assert!(value("bust girth") <= value("chest girth") + 0.002);
    let straight = value("shoulder breadth");
    assert!((straight..1.3 * straight).contains(&value("shoulder width over the back")));
}

#[test]
fn every_value_is_the_length_of_its_path() {
    let model = BodyModel::load_default().unwrap();
    let table = table(&model, &model.skinned(&[0.5, 1.0]));
    for m in &table.measures {
        let points: Vec<Point3<f64>> = m.path.iter().map(|p| Point3::from(*p)).collect();
        let length: f64 = points.windows(2).map(|s| (s[1] - s[0]).norm()).sum();
        assert!((length - m.value_m).abs() < 1e-6, "{}: {length} along the path, {}", m.name, m.value_m);
    }
    assert!(table.landmarks.iter().any(|l| l.name == "back neck point" && l.position[1] > 1.2));
}

#[test]
fn every_measure_says_how_it_is_defined_and_the_docs_say_the_same() {
    let docs = include_str!("../../docs/measurements.md");
    let model = BodyModel::load_default().unwrap();
    let table = table(&model, &model.skinned(&[]));
    for m in &table.measures {
        let name = m.name.trim_start_matches("left ").trim_start_matches("right ");
        let wording = m.definition.split(": ").last().unwrap();
        let row = docs.lines().find(|line| line.starts_with(&format!("| {name} |")));
        let row = row.unwrap_or_else(|| panic!("docs/measurements.md has no row for `{name}`"));
        let words: &str = if m.definition.starts_with("ISO") { wording } else { &m.definition };
        assert!(row.contains(words), "docs/measurements.md defines `{name}` in other words than `{words}`");
        if let Some(clause) = m.definition.strip_prefix("ISO 8559-1:2017, ").and_then(|d| d.split(':').next()) {
            assert!(row.contains(clause), "docs/measurements.md gives `{name}` another clause than {clause}");
        }
    }
    let lines: Vec<String> = table.csv().lines().map(String::from).collect();
    assert_eq!(lines.len(), table.measures.len() + 2);
    assert!(lines[1].ends_with(&format!("\"{}\",,,", table.measures[0].definition)), "{}", lines[1]);
}

#[test]
fn a_mesh_that_is_not_a_body_is_refused() {
    let model = BodyModel::load_default().unwrap();
    let mut body = model.skinned(&[]);
    body.mesh.positions.iter_mut().for_each(|p| *p = Point3::from(Vector3::zeros()));
    assert!(measure_table(&model, &body).is_err_and(|e| e.to_string().contains("too small to be measured")));
    body.mesh = Mesh::default();
    assert!(measure_table(&model, &body).is_err_and(|e| e.to_string().contains("0 vertices")));
}
