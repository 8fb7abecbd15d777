//! Weights carried onto a scan.

mod common;

use common::{mean_distance, person, scanned};
use nalgebra::{UnitQuaternion, Vector3};
use toile_character::{BodyModel, Joint};
use toile_fitting::{rig_scan, rigged_scan};
use toile_geometry::Mesh;

#[test]
fn a_rigged_scan_moves_like_the_body_it_shows() {
    let model = BodyModel::load_default().unwrap();
    let truth = person(&model, 21, 60.0);
    let body = model.skinned(&truth.beta);
    let rigged = rigged_scan(&truth.mesh, &body, &truth.pose);
    assert!(mean_distance(&rigged.posed(&truth.pose), &truth.mesh.positions) < 1e-5);
    let mut next = truth.pose.clone();
    *next.rotation_mut(Joint::LeftUpperArm) *= UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.3, -0.4));
    let moved = mean_distance(&rigged.posed(&next), &body.posed(&next));
    assert!(moved < 0.0015, "{moved}");
}

#[test]
fn weights_sum_to_one_and_hands_do_not_follow_the_hips() {
    let model = BodyModel::load_default().unwrap();
    let mut truth = person(&model, 22, 0.0);
    // arms hang down: hands beside the thighs
    for (arm, turn) in [(Joint::LeftUpperArm, -0.7), (Joint::RightUpperArm, 0.7)] {
        *truth.pose.rotation_mut(arm) = UnitQuaternion::from_scaled_axis(Vector3::z() * turn);
    }
    truth.mesh = Mesh::new(model.posed(&truth.beta, &truth.pose), model.triangles.clone());
    truth.mesh.recompute_normals();
    let scan = scanned(&model, &truth, 0.001, 22);
    let body = model.skinned(&truth.beta);
    let weights = rig_scan(&scan, &body, &truth.pose);
    assert_eq!(weights.len(), scan.positions.len());
    for v in 0..weights.len() {
        let sum: f32 = weights.of(v).map(|i| i.1).sum();
        assert!((sum - 1.0).abs() < 1e-5);
    }
    let hand = truth.pose.joint_positions(&body.skeleton)[Joint::LeftMiddleProximal.index()].cast::<f32>();
    let near = |v: &usize| (scan.positions[*v] - hand).norm() < 0.02;
    let of_arm = |j: u8| Joint::from_index(j as usize).is_some_and(|j| j.name().starts_with("left"));
    let hands: Vec<usize> = (0..weights.len()).filter(near).collect();
    assert!(!hands.is_empty());
    for v in hands {
        let arm: f32 = weights.of(v).filter(|i| of_arm(i.0)).map(|i| i.1).sum();
        assert!(arm > 0.9, "vertex {v} of the hand follows the trunk: {arm}");
    }
}
