//! Cost of posing a mesh of 73,000 vertices with normals, on one thread, by each way of skinning.
#![allow(clippy::unwrap_used, missing_docs)]

use std::{collections::BTreeMap, hint::black_box};

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{UnitQuaternion, Vector3};
use toile_character::{BodyModel, PosedSkin, SkinWeights, SkinnedMesh, Skinner, Skinning, skinning};
use toile_geometry::Mesh;

const VERTICES: usize = 73_000;

/// Edges cut in the middle, weights interpolated, and the first vertices of the result.
fn fine_body(body: &SkinnedMesh) -> (Mesh, SkinWeights) {
    let (mut positions, mut weights, mut middles) =
        (body.mesh.positions.clone(), body.weights.clone(), BTreeMap::new());
    let mut fine = body.mesh.triangles.clone();
    while positions.len() < VERTICES {
        let coarse = std::mem::take(&mut fine);
        let source = weights.clone();
        for [a, b, c] in coarse {
            let [d, e, f] = [[a, b], [b, c], [c, a]].map(|[a, b]| {
                *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                    positions.push(nalgebra::center(&positions[a as usize], &positions[b as usize]));
                    weights.push_interpolated(&source, [a, b, b], [0.5, 0.5, 0.0]);
                    positions.len() as u32 - 1
                })
            });
            fine.extend([[a, d, f], [d, b, e], [f, e, c], [d, e, f]]);
        }
    }
    let mesh = Mesh::new(positions, fine);
    let normals = mesh.vertex_normals();
    let kept: Vec<u32> = (0..VERTICES as u32).collect();
    let mut mesh = mesh.gather(&kept, Vec::new());
    mesh.normals = normals[..VERTICES].to_vec();
    (mesh, weights.gather(&kept))
}

fn ways(c: &mut Criterion) {
    let body = BodyModel::load_default().unwrap().skinned(&[]);
    let (mesh, weights) = fine_body(&body);
    let skinner = Skinner::new(&mesh, &weights).unwrap();
    let mut pose = toile_character::Pose::identity();
    for (i, rotation) in pose.rotations.iter_mut().enumerate() {
        let t = i as f64;
        *rotation = UnitQuaternion::from_scaled_axis(0.5 * Vector3::new(t.sin(), (1.7 * t).cos(), (0.6 * t).sin()));
    }
    let transforms = pose.skinning_transforms(&body.skeleton);
    let mut posed = PosedSkin::default();
    for way in Skinning::ALL {
        c.bench_function(&format!("skinning/{way}/{VERTICES}"), |b| {
            b.iter(|| skinner.pose(black_box(&transforms), way, &mut posed));
        });
    }
    let mut frames = PosedSkin::with_frames();
    c.bench_function(&format!("skinning/log with frames/{VERTICES}"), |b| {
        b.iter(|| skinner.pose(black_box(&transforms), Skinning::Log, &mut frames));
    });
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    c.bench_function(&format!("skinning/linear, positions alone, matrices gathered/{VERTICES}"), |b| {
        one_thread.install(|| b.iter(|| skinning::skin(&mesh.positions, &weights, black_box(&transforms))));
    });
    c.bench_function(&format!("skinning/prepare/{VERTICES}"), |b| b.iter(|| Skinner::new(&mesh, &weights)));
}

criterion_group!(benches, ways);
criterion_main!(benches);
