//! Trials that every camera must stand, whatever its kind: what the tests of the drivers share.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::{Arc, Mutex},
};

use toile_capture::{CaptureError, Frame, Recorder, RecorderOptions, Replay, Source};
use toile_driver_transport::{
    Bus,
    simulated::{SimulatedBus, SimulatedDevice},
};

/// Unplugs of a trial.
const CYCLES: u64 = 100;
/// Cycles after which memory and descriptors are first looked at: pools have filled by then.
const SETTLED: u64 = 20;

/// Frames until there are `count`, or the end, or an error.
pub fn take(source: &mut dyn Source, count: usize) -> (Vec<Frame>, Option<CaptureError>) {
    let mut frames = Vec::new();
    while frames.len() < count {
        match source.next_frame() {
            Ok(Some(frame)) => frames.push(frame),
            Ok(None) => break,
            Err(error) => return (frames, Some(error)),
        }
    }
    (frames, None)
}

/// A camera that unplugs itself is plugged in and opened by `open` (which gets the number of the cycle), recorded to its end, and
/// given back, a hundred times over one bus.
///
/// # Panics
/// Where a take does not end with "unplugged" or is not readable to its last frame, or where the device, files,
/// descriptors or more than `slack_kb` of memory stay behind. Other tests of the program may need memory meanwhile.
pub fn unplugged_a_hundred_times<M: SimulatedDevice + 'static>(
    folder: &Path,
    slack_kb: u64,
    mut open: impl FnMut(u64, &SimulatedBus) -> (Arc<Mutex<M>>, Box<dyn Source>),
) {
    let bus = SimulatedBus::default();
    let mut settled = (0, 0);
    for cycle in 0..CYCLES {
        let (model, mut camera) = open(cycle, &bus);
        let (frames, error) = take(&mut *camera, 9);
        assert!(error.is_some_and(|e| e.to_string().contains("unplugged")), "cycle {cycle}");
        assert!(!frames.is_empty(), "cycle {cycle}");
        let path = record(folder, "cycle.mcap", &*camera, &frames);
        drop(camera);
        let replay = open_replay(&path);
        assert!(replay.lost().is_none() && replay.len() == frames.len() as u64, "cycle {cycle}");
        assert!(replay.frame(replay.len() - 1).ok().as_ref() == frames.last(), "cycle {cycle}");
        assert!(bus.list().is_ok_and(|list| list.is_empty()), "cycle {cycle}: it is still on the bus");
        assert_eq!(Arc::strong_count(&model), 1, "cycle {cycle}: the device was not given back");
        drop((replay, fs::remove_file(path)));
        if cycle == SETTLED {
            settled = (open_files(), resident_kb());
        }
    }
    let (files, memory) = (open_files(), resident_kb());
    assert!(files <= settled.0, "{files} descriptors, before {}", settled.0);
    assert!(memory < settled.1 + slack_kb, "{memory} kB, before {} kB", settled.1);
}

/// Records `count` frames, replays and records them again.
///
/// # Panics
/// Where the frames or the two files differ.
pub fn recorded_again_is_the_same(folder: &Path, camera: &mut dyn Source, count: usize) {
    let (live, _) = take(camera, count);
    assert_eq!(live.len(), count);
    let first = record(folder, "first.mcap", camera, &live);
    let mut replay = open_replay(&first);
    let (replayed, _) = take(&mut replay, count + 1);
    let second = record(folder, "second.mcap", &replay, &replayed);
    let mut again = open_replay(&second);
    assert_eq!((replay.rig(), again.rig()), (camera.rig(), camera.rig()));
    assert!(live == replayed && live == take(&mut again, count + 1).0);
    assert!(fs::read(first).ok() == fs::read(second).ok(), "the files differ");
}

/// Takes `count` frames, each the next one of the camera, and keeps none.
///
/// # Panics
/// Where a frame is lost, or memory grows by more than `slack_kb` after the first tenth.
pub fn memory_stays_flat(camera: &mut dyn Source, count: u64, slack_kb: u64) {
    let mut before = 0;
    for k in 0..count {
        let frame = camera.next_frame().ok().flatten();
        assert_eq!(frame.map(|f| (f.device_frame, f.lost_before)), Some((k, 0)));
        if k == count / 10 {
            before = resident_kb();
        }
    }
    assert!(resident_kb() < before + slack_kb, "{} kB, before {before} kB", resident_kb());
}

fn record(folder: &Path, name: &str, of: &dyn Source, frames: &[Frame]) -> PathBuf {
    let path = folder.join(name);
    let written = Recorder::create(&path, of.rig(), RecorderOptions::default()).and_then(|mut recorder| {
        frames.iter().try_for_each(|frame| recorder.write(frame))?;
        recorder.finish()
    });
    assert!(written.is_ok(), "{}: {written:?}", path.display());
    path
}

fn open_replay(path: &Path) -> Replay {
    match Replay::open(path) {
        Ok(replay) => replay,
        Err(error) => panic!("{}: {error}", path.display()),
    }
}

fn open_files() -> usize {
    fs::read_dir("/proc/self/fd").map_or(0, Iterator::count)
}

/// Memory of this program now, kB; 0 where the system does not say.
pub fn resident_kb() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmRSS:"));
    line.and_then(|l| l.split_whitespace().next()?.parse().ok()).unwrap_or(0)
}
