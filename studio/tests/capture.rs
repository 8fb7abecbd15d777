//! `toile capture`: what it records, how it stops, what an unplugged camera leaves.

#![allow(missing_docs, clippy::unwrap_used)]

mod common;

use std::{
    fs,
    path::Path,
    process::Stdio,
    sync::{Arc, Mutex, atomic::AtomicBool},
    time::{Duration, Instant},
};

use common::{exits, toile};
use toile_capture::{Frame, Replay, Source};
use toile_driver_kinect1::{Kinect1, Settings};
use toile_driver_simulated::kinect1::{Pattern, SimulatedCamera};
use toile_driver_transport::simulated::SimulatedBus;
use toile_live::{Pace, Stop, record};

fn frames(path: &Path) -> Vec<Frame> {
    let replay = Replay::open(path).unwrap();
    assert!(replay.lost().is_none());
    (0..replay.len()).map(|i| replay.frame(i).unwrap()).collect()
}

/// Half a second of a camera made of code.
fn record_kinect(path: &Path) {
    let bus = SimulatedBus::default();
    bus.plug(Arc::new(Mutex::new(SimulatedCamera::new(Pattern::default()))));
    let kinect = Box::new(Kinect1::open(&bus, None, Settings::default()).unwrap());
    record(kinect, path, (Stop::After(0.5), Pace::Live), &AtomicBool::new(false), &mut |_| {}).unwrap();
}

#[test]
fn a_take_ends_after_its_seconds_and_a_retake_of_its_replay_is_the_same() {
    let dir = tempfile::tempdir().unwrap();
    let subject = dir.path().join("olga");
    let mut first = toile();
    first
        .args(["capture", "--layer", "body", "--device", "synthetic:5", "--seconds", "0.9", "--subject"])
        .arg(&subject);
    let reported = exits(0, &mut first);
    let take = subject.join("takes/00-body.mcap");
    let recorded = frames(&take);
    // Five a second: stopped at the first frame after 0.9 s, at most a queue later.
    assert!((5..10).contains(&recorded.len()), "{}", recorded.len());
    assert_eq!(reported["results"]["frames"], recorded.len());
    assert!(reported["warnings"][0].as_str().unwrap().contains("of the turn"));
    let mut again = toile();
    let copy = dir.path().join("copy.mcap");
    fs::copy(&take, &copy).unwrap();
    let device = format!("replay:{}", copy.display());
    again.args(["capture", "--layer", "body", "--retake", "--device", &device, "--subject"]).arg(&subject);
    exits(0, &mut again);
    assert!(frames(&take) == recorded);
    assert!(frames(&subject.join("takes/rejected/00-body.1.mcap")) == recorded);
}

#[test]
fn a_damaged_recording_is_recorded_again_as_far_as_it_goes_and_that_is_said() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("torn.mcap");
    record_kinect(&path);
    let whole = fs::read(&path).unwrap();
    fs::write(&path, &whole[..whole.len() / 2]).unwrap();
    let (subject, device) = (dir.path().join("olga"), format!("replay:{}", path.display()));
    let mut again = toile();
    again.args(["capture", "--layer", "body", "--device", &device, "--subject"]).arg(&subject);
    let reported = exits(3, &mut again);
    assert!(reported["lost"][0].as_str().unwrap().contains("torn.mcap"), "{reported}");
    assert!(!frames(&subject.join("takes/00-body.mcap")).is_empty());
}

#[test]
fn ctrl_c_finishes_the_file() {
    let dir = tempfile::tempdir().unwrap();
    let subject = dir.path().join("olga");
    let mut command = toile();
    command.args(["capture", "--quiet", "--layer", "body", "--device", "synthetic", "--subject"]).arg(&subject);
    let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
    let part = subject.join("takes/00-body.mcap.part");
    let start = Instant::now();
    while !part.exists() && start.elapsed() < Duration::from_mins(1) {
        std::thread::sleep(Duration::from_millis(20));
    }
    std::thread::sleep(Duration::from_millis(700));
    let pressed = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(pressed.success());
    assert_eq!(child.wait().unwrap().code(), Some(0));
    let recorded = frames(&subject.join("takes/00-body.mcap"));
    assert!(!recorded.is_empty() && recorded.len() < 100 && !part.exists());
}

#[test]
fn a_camera_that_is_not_there_leaves_no_subject_and_a_sentence() {
    let dir = tempfile::tempdir().unwrap();
    let subject = dir.path().join("olga");
    let mut command = toile();
    command.args(["capture", "--layer", "body", "--device", "kinect1:NONE", "--subject"]).arg(&subject);
    let reported = exits(1, &mut command);
    let message = reported["error"]["message"].as_str().unwrap();
    assert!(message.contains("not plugged in") || message.contains("/dev/bus/usb"), "{message}");
    assert!(!subject.exists());
    let mut wrong = toile();
    wrong.args(["capture", "--layer", "body", "--device", "kinect7", "--subject"]).arg(&subject);
    exits(2, &mut wrong);
}

#[test]
fn the_sensors_of_a_rig_file_record_together() {
    let dir = tempfile::tempdir().unwrap();
    let mut first = toile();
    let olga = dir.path().join("olga");
    first.args(["capture", "--layer", "body", "--device", "synthetic:5", "--seconds", "0.9", "--subject"]).arg(&olga);
    exits(0, &mut first);
    let alone = olga.join("takes/00-body.mcap");
    let recorded = frames(&alone);
    let rig = dir.path().join("rig.toml");
    let sensor = |name: &str, z: f64| {
        format!(
            "[[sensor]]\ndevice = \"replay:{}\"\nname = \"{name}\"\nposition = [0.0, 0.0, {z:?}]\n",
            alone.display()
        )
    };
    fs::write(&rig, sensor("front", 0.0) + &sensor("back", 4.0)).unwrap();
    let anna = dir.path().join("anna");
    let mut both = toile();
    both.args(["capture", "--layer", "body", "--rig"]).arg(&rig).arg("--subject").arg(&anna);
    let reported = exits(0, &mut both);
    assert_eq!(reported["results"]["frames"], 2 * recorded.len());
    let take = anna.join("takes/00-body.mcap");
    let sensors = Replay::open(&take).unwrap().rig().sensors.clone();
    let places: Vec<_> = sensors.iter().map(|s| (s.name.as_str(), s.rig_from_depth.translation.z)).collect();
    assert_eq!(places, [("front", 0.0), ("back", 4.0)]);
    for side in 0..2 {
        let its: Vec<Frame> = frames(&take).into_iter().filter(|f| f.sensor == side).collect();
        assert!(its.iter().zip(&recorded).all(|(a, b)| a.depth == b.depth && a.host_time_ns == b.host_time_ns));
        assert_eq!(its.len(), recorded.len());
    }
    let mut wrong = toile();
    wrong.args(["capture", "--layer", "shirt", "--rig"]).arg(dir.path().join("none.toml")).arg("--subject").arg(&anna);
    assert!(exits(1, &mut wrong)["error"]["message"].as_str().unwrap().contains("none.toml"));
}
