//! Benchmarks of bodies of primitives: the whole surface from the primitives, and contours deformed directly; cases are named
//! stage/case/size.
#![allow(missing_docs)]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{UnitQuaternion, Vector3};
use rayon::prelude::*;
use toile_character::{BodyModel, Joint, Pose};
use toile_implicit::{Deformed, Envelope, ImplicitBody, LEVELS, RealTime, fit};

/// Poses of a step made of sines, a phase each.
fn step(phase: f64) -> Pose {
    let mut pose = Pose::identity();
    let swing = 0.6 * phase.sin();
    for (joint, angle) in [
        (Joint::LeftUpperLeg, swing),
        (Joint::RightUpperLeg, -swing),
        (Joint::LeftLowerLeg, 0.5 - 0.5 * phase.cos()),
        (Joint::RightLowerLeg, 0.5 + 0.5 * phase.cos()),
        (Joint::LeftUpperArm, -swing),
        (Joint::RightUpperArm, swing),
    ] {
        *pose.rotation_mut(joint) = UnitQuaternion::from_scaled_axis(Vector3::x() * angle);
    }
    pose
}

fn body(model: &BodyModel) -> ImplicitBody {
    let settings = fit::FitSettings::default();
    fit::fit(model, &model.skinned(&[0.5]), &[0.5], "bench", &[], &settings).expect("the mean person").body
}

fn surfaces(c: &mut Criterion) {
    let model = BodyModel::load_default().expect("the shipped model");
    let body = body(&model);
    let one_core = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let mut group = c.benchmark_group("implicit");
    group.sample_size(20);
    let poses: Vec<Pose> = (0..16).map(|k| step(0.4 * f64::from(k))).collect();
    for (level, detail) in LEVELS.into_iter().enumerate() {
        let envelope = Envelope::new(&model, &body, detail).expect("a person");
        let count = envelope.sample(&body, &poses[0]).mesh.positions.len();
        let mut k = 0;
        group.bench_function(format!("resample/level{level}/{count}"), |b| {
            b.iter(|| {
                k += 1;
                black_box(envelope.sample(&body, &poses[k % poses.len()]))
            });
        });
        let fast = RealTime::new(&model, &body, &Pose::identity(), detail).expect("a person");
        let mut out = Deformed::default();
        group.bench_function(format!("deform/level{level}/{}", fast.vertex_count()), |b| {
            one_core.install(|| {
                b.iter(|| {
                    k += 1;
                    fast.deform(&poses[k % poses.len()], &mut out);
                    black_box(&out);
                });
            });
        });
    }
    let fast = RealTime::new(&model, &body, &Pose::identity(), LEVELS[3]).expect("a person");
    let mut crowd = vec![Deformed::default(); 100];
    group.bench_function(format!("crowd/level3/100x{}", fast.vertex_count()), |b| {
        b.iter(|| crowd.par_iter_mut().enumerate().for_each(|(k, out)| fast.deform(&poses[k % poses.len()], out)));
    });
    group.finish();
}

criterion_group!(benches, surfaces);
criterion_main!(benches);
