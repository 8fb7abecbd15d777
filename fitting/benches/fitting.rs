//! Cost of the stages on a scan of about 100,000 triangles: the body with 15 and 50 components and joints both ways (their
//! errors are printed first), each step of that fit, the pose under clothes, settling, measures. Nothing is read or written.
#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs)]

use std::{
    hint::black_box,
    sync::Mutex,
    time::{Duration, Instant},
};

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{DMatrix, DVector};
use toile_character::{BodyModel, JointRegressor, Pose, SkinnedMesh};
use toile_fitting::{FitSettings, UnderSettings, fit_body, measure_table, pose_under, settle_under};
use toile_geometry::Mesh;

#[path = "../tests/common/mod.rs"]
mod common;
use common::{Numbers, joint_distance, strangers, surface};

/// A person of other sliders than the model's, its pose, and its scan with every triangle cut in four.
fn stranger(model: &BodyModel) -> (SkinnedMesh, Pose, Mesh) {
    let body = strangers::read(model, include_bytes!("../tests/data/strangers6.bin")).swap_remove(2);
    let mut numbers = Numbers(7);
    let pose = strangers::random_pose(&body, &mut numbers, 1.0);
    let truth = surface::split(&body.posed_mesh(&pose));
    let floor = truth.positions.iter().map(|p| p.y).fold(f32::INFINITY, f32::min);
    let (mut scan, _) = truth.filter_triangles(|t| truth.corners(t).iter().any(|p| p.y > floor + 0.015));
    scan.recompute_normals();
    for (p, n) in scan.positions.iter_mut().zip(&scan.normals) {
        *p += n * (0.001 * numbers.normal()) as f32;
    }
    (body, pose, scan)
}

/// Steps of a fit and the progress at which each begins and ends.
const STEPS: [(&str, f32, f32); 5] = [
    ("step/100k/starts", 0.0, 0.25),
    ("step/100k/heading", 0.25, 0.45),
    ("step/100k/refine", 0.45, 0.7),
    ("step/100k/landmarks-and-conform", 0.7, 0.95),
    ("step/100k/measure-and-judge", 0.95, 1.0),
];

/// The time of one step of a fit.
fn step_time(model: &BodyModel, scan: &Mesh, from: f32, to: f32) -> Duration {
    let times = Mutex::new(Vec::new());
    fit_body(model, scan, &FitSettings::default(), &|p| times.lock().unwrap().push((p, Instant::now()))).unwrap();
    let times = times.into_inner().unwrap();
    let at = |p: f32| times.iter().find(|t| t.0 == p).unwrap().1;
    at(to) - at(from)
}

/// How far joints that follow the shape lie from those of people of other sliders than the model's, before any fit.
fn print_joint_errors(model: &BodyModel) {
    let people = strangers::read(model, include_bytes!("../tests/data/strangers6.bin"));
    for joints in [JointRegressor::Affine, JointRegressor::MeanValue] {
        let model = model.with_joints_by(joints);
        let errors: Vec<f64> = people.iter().map(|p| 1e3 * joint_error(&model, p)).collect();
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        println!("{joints:?}: the 22 body joints of {} people {mean:.2} mm off: {errors:.2?}", people.len());
    }
}

/// Mean distance of the body's joints from those that the model gives to its least-squares shape, metres.
fn joint_error(model: &BodyModel, person: &SkinnedMesh) -> f64 {
    let n = model.component_count();
    let project = |b: usize| -> f64 {
        let column = model.components[b].iter().zip(&person.mesh.positions).zip(&model.mean);
        column.map(|((d, p), m)| f64::from(d.dot(&(p - m)))).sum()
    };
    let dot = |a: usize, b: usize| -> f64 {
        model.components[a].iter().zip(&model.components[b]).map(|(a, b)| f64::from(a.dot(b))).sum()
    };
    let gram = DMatrix::from_fn(n, n, dot);
    let beta = gram.cholesky().unwrap().solve(&DVector::from_fn(n, |b, _| project(b)));
    joint_distance(&model.skeleton_at(beta.as_slice()).rest, &person.skeleton.rest)
}

fn stages(c: &mut Criterion) {
    let model = BodyModel::load_default().unwrap();
    let (truth, pose, scan) = stranger(&model);
    println!("scan: {} triangles", scan.triangles.len());
    print_joint_errors(&model);
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
    for (name, from, to) in STEPS {
        group.bench_function(name, |b| {
            b.iter_custom(|times| (0..times).map(|_| step_time(&model, &scan, from, to)).sum());
        });
    }
    let fit = fit_body(&model, &scan, &FitSettings::default(), &|_| {}).unwrap();
    let settings = UnderSettings::default();
    group.bench_function("under/100k", |b| {
        b.iter(|| pose_under(&fit.body, &[], &fit.pose, black_box(&scan), &settings, &|_| {}).unwrap());
    });
    group.bench_function("settle/100k", |b| {
        b.iter(|| settle_under(&model, &fit.body, &fit.pose, black_box(&scan), &settings).unwrap());
    });
    group.bench_function("measure", |b| {
        b.iter(|| measure_table(&model, black_box(&fit.body)).unwrap());
    });
}

criterion_group!(benches, stages);
criterion_main!(benches);
