//! An outfit in real time takes no memory from frame to frame. A test of its own, because it counts what the whole process takes.
#![allow(clippy::unwrap_used)] // all of it is test code

mod common;

use common::{dressed, striding};
use toile_animation::realtime::Live;
use toile_character::{Pose, Skinning};

#[global_allocator]
static ALLOCATOR: dhat::Alloc = dhat::Alloc;

#[test]
fn nothing_is_allocated_after_the_first_frame() {
    let outfit = dressed();
    let poses: Vec<Pose> = (0..12).map(|k| striding(f64::from(k) / 30.0)).collect();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    pool.install(|| {
        let mut live = Live::new(&outfit, Skinning::Linear).unwrap();
        live.advance(1.0 / 30.0, &poses[0]).unwrap();
        let _profiler = dhat::Profiler::builder().testing().build();
        for pose in &poses[1..] {
            live.advance(1.0 / 30.0, pose).unwrap();
        }
        let blocks = dhat::HeapStats::get().total_blocks;
        assert_eq!(blocks, 0, "{blocks} blocks in {} frames", poses.len() - 1);
    });
}
