//! Benchmarks of the Kinect v2 driver, named stage/case/size: one core, a rendered pattern.
#![allow(missing_docs, clippy::unwrap_used)]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use toile_driver_kinect2::{Calibration, DecodeSettings, Decoder, color, registration::Registration};
use toile_driver_models::kinect2::{Content, Pattern};

fn decoding(c: &mut Criterion) {
    let mut pattern = Pattern::default();
    let [depth, color, p0] = pattern.optics().answers();
    let calibration = Calibration::parse(&depth, &color, &p0).unwrap();
    let mut decoder = Decoder::new(&calibration, DecodeSettings::default());
    let packets: Vec<_> = (0..Pattern::FRAMES).map(|frame| pattern.depth(frame)).collect();
    let mut next = packets.iter().cycle();
    let jpeg = pattern.jpeg(0);
    let registration = Registration::new(&calibration);
    let decoded = decoder.decode(&packets[0]).unwrap();
    let pixels = color::decode(&jpeg).unwrap();
    let mut group = c.benchmark_group("kinect2");
    group.bench_function("decode/depth/512x424", |b| {
        b.iter(|| decoder.decode(next.next().map(|packet| &packet[..]).unwrap_or_default()).unwrap());
    });
    group.bench_function("decode/color/1920x1080", |b| b.iter(|| color::decode(black_box(&jpeg)).unwrap()));
    group.bench_function("register/color/512x424", |b| {
        b.iter(|| registration.register(black_box(&decoded.depth_mm), black_box(&pixels)));
    });
    group.finish();
}

criterion_group!(benches, decoding);
criterion_main!(benches);
