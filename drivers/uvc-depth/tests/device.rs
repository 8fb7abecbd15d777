//! A UVC depth camera made of code: what arrives, and every fault that it can have.
#![allow(missing_docs, clippy::unwrap_used)]

use std::{
    path::PathBuf,
    sync::{Arc, Mutex},
    time::Duration,
};

use toile_capture::{CaptureError, Frame, Source};
use toile_driver_simulated::{
    d435::{self, Content, Pattern},
    uvc::{Fault, StreamFault, Wire},
};
use toile_driver_transport::simulated::{SimulatedBus, SimulatedVideo};
use toile_driver_uvc_depth::{Settings, UvcDepthCamera, nodes};

const CALIBRATION: &str = "name = \"model\"\ndepth_scale = 0.001\n[camera]\nwidth = 640\nheight = 480\nfx = 385.0\nfy = 385.0\ncx = 319.5\ncy = 239.5\n";

fn settings() -> Settings {
    Settings { frame_limit: Duration::from_millis(200), ..Settings::default() }
}

fn file(folder: &tempfile::TempDir, text: &str) -> PathBuf {
    let path = folder.path().join("calibration.toml");
    std::fs::write(&path, text).unwrap();
    path
}

/// The depth node of a D435 is a UVC depth camera as any other.
fn camera(wire: Wire, faults: &[Fault]) -> UvcDepthCamera {
    let bus = SimulatedBus::default();
    let model = d435::model(Pattern::default(), wire).with_faults(faults.iter().copied());
    bus.plug(Arc::new(Mutex::new(model)));
    let video = SimulatedVideo::new(bus);
    let node = nodes::list(&video)[0].node.clone();
    let folder = tempfile::tempdir().unwrap();
    UvcDepthCamera::open(&video, &node, &file(&folder, CALIBRATION), settings()).unwrap()
}

fn fault(frame: u64, packet: usize, what: StreamFault) -> Fault {
    Fault { stream: d435::DEPTH, frame, packet, what }
}

fn take(camera: &mut UvcDepthCamera, count: usize) -> (Vec<Frame>, Option<CaptureError>) {
    let mut frames = Vec::new();
    while frames.len() < count {
        match camera.next_frame() {
            Ok(Some(frame)) => frames.push(frame),
            Ok(None) => break,
            Err(error) => return (frames, Some(error)),
        }
    }
    (frames, None)
}

fn is(frame: &Frame, number: u64) -> bool {
    frame.depth.as_ref().is_some_and(|depth| depth.values == Pattern::default().depth(number, (640, 480)))
}

#[test]
fn frames_are_identical_by_bulk_and_isochronous() {
    for wire in [Wire::Bulk, Wire::Isochronous] {
        let mut camera = camera(wire, &[]);
        for k in 0..10 {
            let frame = camera.next_frame().unwrap().unwrap();
            assert!(is(&frame, k), "{wire:?} frame {k}");
            assert_eq!((frame.index, frame.device_frame, frame.lost_before), (k, k, 0));
        }
        assert_eq!((camera.health().frames, camera.health().lost), (10, 0));
    }
}

#[test]
fn a_damaged_picture_is_a_lost_one_and_its_neighbours_are_whole() {
    for (wire, what, packet) in [
        (Wire::Isochronous, StreamFault::Lost(3), 5),
        (Wire::Isochronous, StreamFault::Damaged(1), 7),
        (Wire::Isochronous, StreamFault::Short(700), 100),
        (Wire::Isochronous, StreamFault::Long(60), 200),
        (Wire::Isochronous, StreamFault::Torn, 100),
        (Wire::Isochronous, StreamFault::HeaderLength(200), 50),
        (Wire::Isochronous, StreamFault::ErrorBit, 50),
        (Wire::Bulk, StreamFault::Short(100), 5),
        (Wire::Bulk, StreamFault::Lost(1), 9),
    ] {
        let mut camera = camera(wire, &[fault(2, packet, what)]);
        let (frames, error) = take(&mut camera, 4);
        assert!(error.is_none(), "{what:?}: {error:?}");
        let stated: Vec<_> = frames.iter().map(|f| (f.device_frame, f.lost_before)).collect();
        assert_eq!(stated, [(0, 0), (1, 0), (3, 1), (4, 0)], "{wire:?} {what:?}");
        assert!(frames.iter().all(|f| is(f, f.device_frame)), "{what:?}");
        assert_eq!(camera.health().lost, 1);
    }
}

#[test]
fn late_packets_are_not_a_loss() {
    let mut camera = camera(Wire::Isochronous, &[fault(2, 30, StreamFault::Late(40))]);
    let (frames, _) = take(&mut camera, 5);
    assert!(frames.iter().zip(0..).all(|(f, k)| is(f, k) && f.lost_before == 0));
}

#[test]
fn a_camera_that_falls_silent_is_restarted_once_and_then_reported() {
    for (wire, what) in
        [(Wire::Isochronous, StreamFault::Silent), (Wire::Bulk, StreamFault::Silent), (Wire::Bulk, StreamFault::Stall)]
    {
        let mut woken = camera(wire, &[fault(3, 4, what)]);
        let (frames, error) = take(&mut woken, 6);
        assert!(error.is_none() && frames.len() == 6, "{what:?}: {error:?}");
        assert_eq!(woken.health().restarts, 1);
        let stated = frames.windows(2).map(|w| w[1].device_frame - w[0].device_frame - u64::from(w[1].lost_before));
        assert!(stated.into_iter().all(|step| step == 1), "{what:?}: numbers go on");
        let always: Vec<_> = (3..60).map(|frame| fault(frame, 4, what)).collect();
        let mut silent = camera(wire, &always);
        let (frames, error) = take(&mut silent, 6);
        assert_eq!(frames.len(), 3, "{wire:?} {what:?}");
        assert!(error.unwrap().to_string().contains("no frame for 0.2 s"));
        assert!(silent.next_frame().unwrap().is_none());
    }
}

#[test]
fn an_unplug_gives_all_whole_frames_then_one_error_then_the_end() {
    let mut camera = camera(Wire::Isochronous, &[fault(4, 100, StreamFault::Unplug)]);
    let (frames, error) = take(&mut camera, 9);
    assert!(frames.len() == 4 && frames.iter().zip(0..).all(|(f, k)| is(f, k)));
    assert!(error.unwrap().to_string().contains("unplugged"));
    assert!(camera.next_frame().unwrap().is_none());
}

#[test]
fn a_node_without_depth_and_a_size_that_it_lacks_are_refused() {
    let bus = SimulatedBus::default();
    bus.plug(Arc::new(Mutex::new(d435::model(Pattern::default(), Wire::Bulk))));
    let video = SimulatedVideo::new(bus);
    let folder = tempfile::tempdir().unwrap();
    let open = |node: &str, text: &str| {
        let opened = UvcDepthCamera::open(&video, node.as_ref(), &file(&folder, text), settings());
        opened.err().map(|e| e.to_string()).unwrap_or_default()
    };
    let color = open("/dev/video4", CALIBRATION);
    assert!(color.contains("YUYV") && color.contains("Z16"), "{color}");
    let other = open("/dev/video0", &CALIBRATION.replace("640", "600"));
    assert!(other.contains("600x480") && other.contains("640x480"), "{other}");
    assert!(open("/dev/video9", CALIBRATION).contains("/dev/video9"));
}
