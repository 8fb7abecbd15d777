//! Cost of a frame of an outfit in real time: a body of 13,000 vertices, a skirt of 4,500 and a jumper, at 30 frames a second.
#![allow(missing_docs, clippy::unwrap_used)]

#[path = "../tests/common/mod.rs"]
mod common;

use criterion::{Criterion, criterion_group, criterion_main};
use toile_animation::realtime::Live;
use toile_character::Skinning;

fn frame(c: &mut Criterion) {
    let outfit = common::dressed();
    let mut live = Live::new(&outfit, Skinning::Linear).unwrap();
    let mut seconds = 0.0;
    c.bench_function("realtime/frame/skirt and jumper", |b| {
        b.iter(|| {
            seconds += 1.0 / 30.0;
            live.advance(1.0 / 30.0, &common::striding(seconds)).unwrap();
        });
    });
}

criterion_group!(benches, frame);
criterion_main!(benches);
