//! The conformed body against its scan: near it, unfolded, not crossing itself more than the model does.

mod common;

use common::{person, scanned};
use nalgebra::{UnitQuaternion, Vector3};
use toile_character::{BodyModel, Joint};
use toile_fitting::{FitSettings, fit_body};
use toile_geometry::{Mesh, bvh::Bvh, intersection::self_crossings};

fn crossings(mesh: &Mesh) -> Vec<[u32; 2]> {
    self_crossings(mesh, &Bvh::new(&mesh.positions, &mesh.triangles))
}

#[test]
fn conforming_adds_no_crossing_and_turns_no_triangle_over() {
    let model = BodyModel::load_default().unwrap();
    for (seed, arms_down) in [(41, 0.0), (42, 0.55)] {
        let mut truth = person(&model, seed, 15.0);
        for (arm, side) in [(Joint::LeftUpperArm, -1.0), (Joint::RightUpperArm, 1.0)] {
            *truth.pose.rotation_mut(arm) *= UnitQuaternion::from_scaled_axis(Vector3::z() * side * arms_down);
        }
        truth.mesh = Mesh::new(model.posed(&truth.beta, &truth.pose), model.triangles.clone());
        truth.mesh.recompute_normals();
        let fit = fit_body(&model, &scanned(&model, &truth, 0.001, seed), &FitSettings::default(), &|_| {}).unwrap();
        let body = fit.posed_body();
        let before = crossings(&fit.model_mesh);
        let added = crossings(&body).into_iter().filter(|pair| before.binary_search(pair).is_err()).count();
        assert_eq!(added, 0, "seed {seed}: crossing pairs added, the model has {}", before.len());
        let (was, is) = (fit.model_mesh.triangle_normals(), body.triangle_normals());
        assert_eq!(was.iter().zip(&is).filter(|(a, b)| a.dot(b) < 0.0).count(), 0, "seed {seed}");
        assert!(fit.report.scan_to_body.mean_mm < 0.8, "seed {seed}: {:?}", fit.report.scan_to_body);
    }
}
