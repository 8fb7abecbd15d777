//! Cost of the body model: loading, shape, joints both ways, skinning. Their errors on held-out people are in the
//! asset's report (`report.joints_affine_mm`, `report.joints_mvc_mm`), printed first.
#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs)]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use toile_character::{BodyModel, JointRegressor};

fn body(c: &mut Criterion) {
    let model = BodyModel::load_default().unwrap();
    let report = &model.population.report;
    println!("joints, mm: affine {} mean value {}", report["joints_affine_mm"], report["joints_mvc_mm"]);
    let beta: Vec<f64> = (0..50).map(|i| (f64::from(i) * 1.7).sin()).collect();
    let pose = model.t_pose(&beta);
    model.mean_value_weights();
    c.bench_function("body/load/50", |b| b.iter(|| BodyModel::load_default().unwrap()));
    for k in [15, 50] {
        c.bench_function(&format!("body/shape/{k}"), |b| b.iter(|| model.shape(black_box(&beta[..k]))));
    }
    for (name, way) in [("affine", JointRegressor::Affine), ("mean-value", JointRegressor::MeanValue)] {
        c.bench_function(&format!("body/joints/{name}"), |b| b.iter(|| model.skeleton_by(black_box(&beta), way)));
    }
    c.bench_function("body/posed/50", |b| b.iter(|| model.posed(black_box(&beta), &pose)));
}

criterion_group!(benches, body);
criterion_main!(benches);
