//! Benchmarks of stereo matching; cases are named stage/case/size, the size being columns × rows × disparities.
#![allow(missing_docs, clippy::unwrap_used)]

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use toile_stereo::{GrayImage, MatchSettings, match_pair};

/// A textured surface whose disparity runs from 4 to a third of the search.
fn pair(width: u32, height: u32, disparities: u32) -> (GrayImage, GrayImage) {
    let texture =
        |u: u32, v: u32| (u.wrapping_mul(0x9e37_79b1) ^ v.wrapping_mul(0x85eb_ca6b)).wrapping_mul(0xc2b2_ae35);
    let image = |pixel: &dyn Fn(u32, u32) -> u8| {
        let pixels = (0..width * height).map(|i| pixel(i % width, i / width)).collect();
        GrayImage { width, height, pixels }
    };
    let shift = |v: u32| 4 + v * disparities / 3 / height;
    (image(&|u, v| (texture(u + 999, v) >> 24) as u8), image(&|u, v| (texture(u + 999 + shift(v), v) >> 24) as u8))
}

fn benches(c: &mut Criterion) {
    let mut group = c.benchmark_group("stereo");
    group.sample_size(10);
    for (width, height, disparities) in [(640, 480, 64), (1280, 720, 128)] {
        let (left, right) = pair(width, height, disparities);
        let settings = MatchSettings { disparities, ..MatchSettings::default() };
        group.throughput(Throughput::Elements(u64::from(width * height * disparities)));
        group.bench_function(format!("match/{width}x{height}x{disparities}"), |b| {
            b.iter(|| match_pair(black_box(&left), black_box(&right), &settings).unwrap());
        });
    }
    group.finish();
}

criterion_group!(stereo, benches);
criterion_main!(stereo);
