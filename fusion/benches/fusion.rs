//! Benchmarks of the fusion stage over the session that ships with Toile; cases are named stage/case/size.
#![allow(missing_docs, clippy::unwrap_used)]

use std::{hint::black_box, path::Path};

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use toile_capture::{Frame, Replay, Rig, Source};
use toile_fusion::{Fuser, FusionSettings, fuse, survey};

/// Frames pushed by the streaming case.
const PUSHED: usize = 20;

fn take() -> Replay {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../recorded/rowan/takes/00-body.mcap");
    Replay::open(&path).unwrap()
}

fn frames() -> (Rig, Vec<Frame>) {
    let mut replay = take();
    let frames = std::iter::from_fn(|| replay.next_frame().unwrap()).collect();
    (replay.rig().clone(), frames)
}

fn benches(c: &mut Criterion) {
    let (rig, frames) = frames();
    let settings = FusionSettings::default();
    let volume = survey(&rig, &frames, &settings).unwrap();
    let mut group = c.benchmark_group("fusion");
    group.sample_size(10);
    let start = || Fuser::new(&rig, Some(volume.clone()), settings.clone()).unwrap();
    group.bench_function(format!("push/512x424/{PUSHED}"), |b| {
        b.iter_batched(
            start,
            |mut fuser| {
                for frame in &frames[..PUSHED] {
                    black_box(fuser.push(frame).unwrap());
                }
            },
            BatchSize::LargeInput,
        );
    });
    group.bench_function(format!("take/512x424/{}", frames.len()), |b| {
        b.iter_batched(take, |mut replay| fuse(&mut replay, &settings, &|_| {}).unwrap(), BatchSize::LargeInput);
    });
    group.finish();
}

criterion_group!(fusion, benches);
criterion_main!(fusion);
