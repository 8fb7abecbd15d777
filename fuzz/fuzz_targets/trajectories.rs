//! Trajectories in TUM's format; what is read comes back from what is written.
#![no_main]

use libfuzzer_sys::fuzz_target;
use toile_capture::trajectory;

fuzz_target!(|text: &str| {
    if let Ok(poses) = trajectory::parse(text) {
        // Far-off translations lose digits, but not the line.
        let again = trajectory::parse(&trajectory::to_text(&poses)).expect("what was written can be read");
        assert!(poses.iter().zip(&again).all(|(a, b)| a.time_ns == b.time_ns) && poses.len() == again.len());
    }
});
