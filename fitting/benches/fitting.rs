//! Cost of the stages on a scan of about 100,000 triangles: the body with 15 and 50 components and joints both ways (their
//! errors are printed first), the pose under clothes, settling, measures.
#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs)]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use toile_character::{BodyModel, JointRegressor, Pose, SkinnedMesh};
use toile_fitting::{FitSettings, UnderSettings, fit_body, measure_table, pose_under, settle_under};
use toile_geometry::Mesh;

#[path = "../tests/common/mod.rs"]
mod common;
use common::{Numbers, joint_distance, strangers, surface};

/// A person outside the model's span, its pose, and its scan with every triangle cut in four.
fn stranger(model: &BodyModel) -> (SkinnedMesh, Pose, Mesh) {
    let body = strangers::read(model, include_bytes!("../tests/data/strangers6.bin")).swap_remove(2);
    let mut numbers = Numbers(7);
    let pose = strangers::stance(&body, &mut numbers, 1.0);
    let truth = surface::split(&body.posed_mesh(&pose));
    let floor = truth.positions.iter().map(|p| p.y).fold(f32::INFINITY, f32::min);
    let (mut scan, _) = truth.filter_triangles(|t| truth.corners(t).iter().any(|p| p.y > floor + 0.015));
    scan.recompute_normals();
    for (p, n) in scan.positions.iter_mut().zip(&scan.normals) {
        *p += n * (0.001 * numbers.normal()) as f32;
    }
    (body, pose, scan)
}

fn stages(c: &mut Criterion) {
    let model = BodyModel::load_default().unwrap();
    let (truth, pose, scan) = stranger(&model);
    println!("scan: {} triangles", scan.triangles.len());
    let mut group = c.benchmark_group("fit");
    group.sample_size(10);
    for (name, components, joints) in [
        ("body/100k/k50-affine", 50, JointRegressor::Affine),
        ("body/100k/k15-affine", 15, JointRegressor::Affine),
        ("body/100k/k50-mean-value", 50, JointRegressor::MeanValue),
        ("body/100k/k15-mean-value", 15, JointRegressor::MeanValue),
    ] {
        let settings = FitSettings { components, joints, ..FitSettings::default() };
        let fit = fit_body(&model, &scan, &settings, &|_| {}).unwrap();
        let off = joint_distance(&fit.pose.joint_positions(&fit.skeleton), &pose.joint_positions(&truth.skeleton));
        let model_mm = fit.report.scan_to_model.mean_mm;
        println!("{name}: joints {:.1} mm off, model {model_mm:.2} mm from the scan", 1e3 * off);
        group.bench_function(name, |b| b.iter(|| fit_body(&model, black_box(&scan), &settings, &|_| {}).unwrap()));
    }
    let fit = fit_body(&model, &scan, &FitSettings::default(), &|_| {}).unwrap();
    let settings = UnderSettings::default();
    group.bench_function("under/100k", |b| {
        b.iter(|| pose_under(&fit.body, &[], &fit.pose, black_box(&scan), &settings, &|_| {}).unwrap());
    });
    group.bench_function("settle/100k", |b| {
        b.iter(|| settle_under(&model, &fit.body, &fit.pose, black_box(&scan)).unwrap());
    });
    group.bench_function("measure", |b| {
        b.iter(|| measure_table(&model, black_box(&fit.body), &fit.measurements).unwrap());
    });
}

criterion_group!(benches, stages);
criterion_main!(benches);
