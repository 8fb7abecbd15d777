//! Recordings: a whole MCAP file; or records without a chunk (which have no checksum to get past), with our rig before
//! them or as another program's.
#![no_main]

use std::{path::PathBuf, sync::LazyLock};

use libfuzzer_sys::fuzz_target;
use toile_capture::{Replay, Source};

const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// One file for each process, in memory where the system has such a folder.
static FILE: LazyLock<PathBuf> = LazyLock::new(|| {
    let memory = PathBuf::from("/dev/shm");
    let folder = if memory.is_dir() { memory } else { std::env::temp_dir() };
    folder.join(format!("toile-fuzz-{}.mcap", std::process::id()))
});

fn rig_record() -> Vec<u8> {
    let camera = r#"{"width":4,"height":2,"fx":4.0,"fy":4.0,"cx":2.0,"cy":1.0,"distortion":[0,0,0,0,0]}"#;
    let pose = r#"{"rotation":[0,0,0,1],"translation":[0,0,0]}"#;
    let identity = r#"{"model":"","serial":"","firmware":""}"#;
    let rig = format!(
        r#"{{"sensors":[{{"name":"a","identity":{identity},"depth":{camera},"depth_scale":0.001,"color":{camera},"color_from_depth":{pose},"rig_from_depth":{pose},"fps":30.0}}]}}"#
    );
    let string = |text: &str| [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat();
    let pairs = [string("rig"), string(&rig)].concat();
    let body = [string("toile.recording"), (pairs.len() as u32).to_le_bytes().to_vec(), pairs].concat();
    [&[0x0c], (body.len() as u64).to_le_bytes().as_slice(), &body].concat()
}

fuzz_target!(|bytes: &[u8]| {
    let file = match bytes {
        whole if whole.starts_with(MAGIC) => whole.to_vec(),
        [first, records @ ..] if first & 1 == 0 => [MAGIC, &rig_record(), records].concat(),
        [_, records @ ..] => [MAGIC, records].concat(),
        [] => return,
    };
    if std::fs::write(&*FILE, file).is_err() {
        return;
    }
    let Ok(mut replay) = Replay::open(&FILE) else { return };
    for _ in 0..replay.len().min(20) {
        if let Ok(Some(frame)) = replay.next_frame()
            && let Some(color) = frame.color
        {
            let _ = color.decode(frame.index);
        }
    }
});
