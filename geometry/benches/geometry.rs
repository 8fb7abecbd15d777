//! Benchmarks of the geometry crate on surfaces made here; cases are named stage/case/size.
#![allow(missing_docs)]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::Point3;
use toile_geometry::{Mesh, bvh::Bvh, decimate::decimate};

/// A closed torus of `rings` by `sides` quads with folds and noise, 1.5 m across, with colours.
fn folded_torus(rings: u32, sides: u32) -> Mesh {
    let mut mesh = Mesh::default();
    let mut seed = 1u32;
    for i in 0..rings {
        for j in 0..sides {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let noise = 2e-4 * ((seed >> 8) as f32 / 8_388_608.0 - 1.0);
            let (a, b) =
                (std::f32::consts::TAU * i as f32 / rings as f32, std::f32::consts::TAU * j as f32 / sides as f32);
            let tube = 0.2 + 0.01 * (24.0 * a).sin() * (6.0 * b).cos() + 0.002 * (90.0 * b + 7.0 * a).sin() + noise;
            let radius = 0.55 + tube * b.cos();
            mesh.positions.push(Point3::new(radius * a.cos(), tube * b.sin(), radius * a.sin()));
            mesh.colors.push([(127.0 + 120.0 * (9.0 * a).sin()) as u8, (40.0 * b) as u8, 90]);
        }
    }
    let at = |i: u32, j: u32| (i % rings) * sides + j % sides;
    for i in 0..rings {
        for j in 0..sides {
            mesh.triangles.push([at(i, j), at(i, j + 1), at(i + 1, j + 1)]);
            mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i + 1, j)]);
        }
    }
    mesh
}

fn decimation(c: &mut Criterion) {
    let mesh = folded_torus(500, 500);
    let mut group = c.benchmark_group("geometry/decimate");
    group.sample_size(10);
    group.bench_function("500k", |b| b.iter(|| decimate(black_box(&mesh), 50_000)));
    group.finish();
}

fn hierarchy(c: &mut Criterion) {
    let mesh = folded_torus(160, 160);
    let mut tree = Bvh::new(&mesh.positions, &mesh.triangles);
    let mut group = c.benchmark_group("geometry/bvh");
    group.bench_function("build/51k", |b| b.iter(|| Bvh::new(black_box(&mesh.positions), &mesh.triangles)));
    group.bench_function("refit/51k", |b| b.iter(|| tree.refit(black_box(&mesh.positions), &mesh.triangles)));
    group.finish();
}

criterion_group!(benches, decimation, hierarchy);
criterion_main!(benches);
