//! Every fault that a RealSense camera can have, and what the driver reports.
#![allow(missing_docs)]

mod common;

use std::{path::Path, time::Instant};

use common::{color_fault, depth_fault, faulty, has_color_of, has_depth_of, pattern, plugged, settings};
use toile_capture::Source;
use toile_driver_realsense::{Health, Realsense};
use toile_driver_simulated::{
    d435::MonitorFault,
    trials::take,
    uvc::{StreamFault, Wire},
};
use toile_driver_transport::{
    TransportError,
    simulated::SimulatedVideo,
    udev,
    video::{NodeInfo, Video, VideoNode},
};

/// Frame 2's depth is spoilt by a fault: it comes with colour alone, its neighbours are whole.
fn spoils_frame_2(wire: Wire, what: StreamFault, packet: usize) -> Health {
    let mut camera = faulty(wire, &[depth_fault(2, packet, what)]);
    let (frames, error) = take(&mut camera, 6);
    assert!(error.is_none(), "{what:?}: {error:?}");
    for (frame, k) in frames.iter().zip(0..) {
        assert_eq!((frame.device_frame, frame.lost_before), (k, 0), "{what:?}");
        assert_eq!(has_depth_of(frame, k), k != 2, "{wire:?} {what:?} at {packet} in frame {k}");
        assert!(frame.depth.is_some() == (k != 2) && has_color_of(frame, k), "{what:?} in frame {k}");
    }
    let health = camera.health();
    assert_eq!((health.alone, health.lost_frames), ([0, 1], 0), "{what:?}");
    health
}

#[test]
fn lost_damaged_short_and_torn_packets_cost_their_picture_only() {
    for what in [
        StreamFault::Lost(1),
        StreamFault::Lost(50),
        StreamFault::Damaged(1),
        StreamFault::Short(700),
        StreamFault::Short(1),
        StreamFault::Torn,
        StreamFault::HeaderLength(0),
        StreamFault::HeaderLength(250),
        StreamFault::ErrorBit,
    ] {
        for packet in [1, 100, 200] {
            let health = spoils_frame_2(Wire::Isochronous, what, packet);
            // The kernel's number shows it, where the packets that came were enough to count the picture at all.
            assert_eq!(health.lost_pictures[0], 1, "{what:?} at {packet}");
        }
    }
}

#[test]
fn bulk_payloads_that_are_not_whole_cost_their_picture_only() {
    for (what, packet) in
        [(StreamFault::Lost(1), 3), (StreamFault::Short(100), 5), (StreamFault::Torn, 20), (StreamFault::ErrorBit, 0)]
    {
        spoils_frame_2(Wire::Bulk, what, packet);
    }
}

#[test]
fn more_than_a_picture_holds_is_a_damaged_picture() {
    // Room at the end of the last packet, so that the surplus comes in one payload.
    assert_eq!(spoils_frame_2(Wire::Isochronous, StreamFault::Long(60), 200).lost_pictures[0], 1);
}

/// Pictures are distinguished by one bit: after a picture that is lost whole, the kernel takes the next one for more of the
/// one before, and drops it too (`uvc_video_decode_start`). The camera's time shows how many are missing.
#[test]
fn a_picture_that_is_lost_whole_takes_the_next_with_it_and_both_are_counted() {
    for (wire, what) in [(Wire::Isochronous, StreamFault::Lost(usize::MAX)), (Wire::Bulk, StreamFault::HeaderLength(1))]
    {
        let mut camera = faulty(wire, &[depth_fault(3, 0, what), color_fault(3, 0, what)]);
        let (frames, _) = take(&mut camera, 5);
        let stated: Vec<_> = frames.iter().map(|f| (f.device_frame, f.lost_before)).collect();
        assert_eq!(stated, [(0, 0), (1, 0), (2, 0), (5, 2), (6, 0)], "{what:?}");
        assert!(frames.iter().all(|f| has_depth_of(f, f.device_frame) && has_color_of(f, f.device_frame)));
        assert_eq!((camera.health().lost_frames, camera.health().alone), (2, [0, 0]));
    }
}

#[test]
fn late_packets_are_not_a_loss() {
    let late = [depth_fault(2, 30, StreamFault::Late(20)), color_fault(3, 0, StreamFault::Late(50))];
    let mut camera = faulty(Wire::Isochronous, &late);
    let (frames, _) = take(&mut camera, 6);
    assert!(frames.iter().zip(0..).all(|(f, k)| has_depth_of(f, k) && has_color_of(f, k) && f.lost_before == 0));
}

#[test]
fn a_time_that_cannot_be_is_replaced_by_the_kernels() {
    let nonsense = StreamFault::Time(3_000_000_000);
    let mut camera = faulty(Wire::Isochronous, &[depth_fault(2, 0, nonsense), color_fault(2, 0, nonsense)]);
    let (frames, _) = take(&mut camera, 6);
    for (frame, k) in frames.iter().zip(0..) {
        assert!(has_depth_of(frame, k) && has_color_of(frame, k) && frame.lost_before == 0, "frame {k}");
        assert!((frame.device_time_ns - (k * 1_000_000_000 / 30) as i64).abs() < 2_000_000, "{frame:?}");
    }
}

#[test]
fn a_jump_of_seconds_is_not_a_loss() {
    let jump = StreamFault::Time(20_000_000);
    let mut camera = faulty(Wire::Isochronous, &[depth_fault(2, 0, jump), color_fault(2, 0, jump)]);
    let (frames, _) = take(&mut camera, 6);
    assert!(frames.iter().zip(0..).all(|(f, k)| has_depth_of(f, k) && has_color_of(f, k) && f.lost_before == 0));
}

/// Depth states its time and colour never does: both go on by one clock, and pair.
#[test]
fn a_stream_that_never_states_its_time_pairs_with_one_that_did() {
    // The camera's clock began seven seconds before the kernel's.
    let time = |k: u64| StreamFault::Time(7_000_000 + (k * 1_000_000 / 30) as u32);
    let stated = (0..60).flat_map(|k| [depth_fault(k, 0, time(k)), color_fault(k, 0, StreamFault::NoTime)]);
    let mut camera = faulty(Wire::Isochronous, &stated.collect::<Vec<_>>());
    let (frames, error) = take(&mut camera, 20);
    assert!(error.is_none(), "{error:?}");
    assert_eq!(frames.iter().map(|f| f.lost_before).sum::<u32>(), 0);
    assert!(frames.iter().zip(0..).skip(12).all(|(f, k)| has_depth_of(f, k) && has_color_of(f, k)));
}

/// By bulk the camera runs ahead of the kernel's clock: pictures whose time is guessed would find the wrong partner.
#[test]
fn a_picture_whose_time_is_not_stated_is_lost_and_counted() {
    let untold: Vec<_> = (2..=4).map(|frame| depth_fault(frame, 0, StreamFault::NoTime)).collect();
    for wire in [Wire::Bulk, Wire::Isochronous] {
        let mut camera = faulty(wire, &untold);
        let (frames, _) = take(&mut camera, 8);
        for (frame, k) in frames.iter().zip(0..) {
            assert_eq!((frame.device_frame, frame.lost_before), (k, 0), "{wire:?}");
            assert!(
                has_color_of(frame, k) && frame.depth.is_some() != untold.iter().any(|f| f.frame == k),
                "{wire:?} {k}"
            );
            assert!(frame.depth.is_none() || has_depth_of(frame, k), "{wire:?} {k}");
        }
        let health = camera.health();
        assert_eq!((health.without_time, health.lost_pictures, health.alone), (3, [3, 0], [0, 3]), "{wire:?}");
    }
}

/// A camera that states no time any more goes on by the kernel's clock.
#[test]
fn a_clock_that_falls_silent_is_replaced_by_the_kernels() {
    let untold =
        (3..100).flat_map(|k| [depth_fault(k, 0, StreamFault::NoTime), color_fault(k, 0, StreamFault::NoTime)]);
    let mut camera = faulty(Wire::Isochronous, &untold.collect::<Vec<_>>());
    let (frames, error) = take(&mut camera, 12);
    assert!(error.is_none(), "{error:?}");
    for frame in &frames {
        assert!(frame.depth.is_none() || has_depth_of(frame, frame.device_frame), "{}", frame.device_frame);
        assert!(frame.color.is_none() || has_color_of(frame, frame.device_frame), "{}", frame.device_frame);
    }
    assert!(frames.iter().filter(|f| f.depth.is_none() || f.color.is_none()).count() <= 1);
    let lost: u32 = frames.iter().map(|f| f.lost_before).sum();
    assert!((8..13).contains(&lost), "{lost}");
}

#[test]
fn a_silent_or_halted_stream_is_restarted_once_and_then_reported() {
    for (wire, what) in
        [(Wire::Isochronous, StreamFault::Silent), (Wire::Bulk, StreamFault::Silent), (Wire::Bulk, StreamFault::Stall)]
    {
        let both = |frame| [depth_fault(frame, 4, what), color_fault(frame, 4, what)];
        let mut camera = faulty(wire, &both(3));
        let (frames, error) = take(&mut camera, 8);
        assert!(error.is_none(), "{what:?}: {error:?}");
        assert_eq!(camera.health().restarts, 1, "{wire:?} {what:?}");
        assert!(frames.iter().all(|f| has_depth_of(f, f.device_frame)));
        // A camera that stays silent.
        let mut camera = faulty(wire, &(3..200).flat_map(both).collect::<Vec<_>>());
        let (frames, error) = take(&mut camera, 12);
        assert_eq!(frames.len(), 3, "{wire:?} {what:?}");
        assert!(error.unwrap().to_string().contains("no frame for 0.2 s"));
        assert!(camera.next_frame().unwrap().is_none());
    }
}

#[test]
fn one_silent_stream_leaves_the_other_unpaired_and_counted() {
    let mut camera = faulty(Wire::Isochronous, &[color_fault(2, 0, StreamFault::Silent)]);
    let (frames, error) = take(&mut camera, 8);
    assert!(error.is_none());
    assert!(frames.iter().zip(0..).all(|(f, k)| has_depth_of(f, k) && f.color.is_some() == (k < 2)));
    assert_eq!(camera.health().alone[0], 6);
}

#[test]
fn an_unplug_gives_all_whole_frames_then_one_error_then_the_end() {
    for wire in [Wire::Isochronous, Wire::Bulk] {
        let mut camera = faulty(wire, &[depth_fault(4, 10, StreamFault::Unplug)]);
        let (frames, error) = take(&mut camera, 12);
        assert!(frames.len() >= 4 && frames[..4].iter().zip(0..).all(|(f, k)| has_depth_of(f, k)));
        assert!(error.unwrap().to_string().contains("unplugged"));
        assert!(camera.next_frame().unwrap().is_none());
    }
}

#[test]
fn firmware_that_answers_nonsense_is_refused_in_words() {
    for (fault, words) in [
        (MonitorFault::Stall, "refused"),
        (MonitorFault::Silence, "no answer"),
        (MonitorFault::Error, "error -1"),
        (MonitorFault::OtherCommand, "answer is to command"),
        (MonitorFault::Length, "says that it has 60000 bytes"),
        (MonitorFault::Bit, "checksum"),
        (MonitorFault::ShortTable, "84 came"),
        (MonitorFault::OtherTable, "was asked for"),
        (MonitorFault::NotReady(u32::MAX), "still starting"),
        (MonitorFault::Nonsense, "error -1"),
    ] {
        let mut model = pattern(Wire::Bulk);
        model.scene().monitor.fault = Some(fault);
        let (bus, ..) = plugged(model);
        let start = Instant::now();
        let opened = Realsense::open(&SimulatedVideo::new(bus), None, settings());
        let error = opened.err().map(|e| e.to_string()).unwrap_or_default();
        assert!(error.contains(words), "{fault:?}: {error}");
        assert!(start.elapsed().as_secs() < 10);
    }
}

#[test]
fn firmware_that_is_starting_is_waited_for() {
    let mut model = pattern(Wire::Bulk);
    model.scene().monitor.fault = Some(MonitorFault::NotReady(2));
    let (bus, ..) = plugged(model);
    assert!(Realsense::open(&SimulatedVideo::new(bus), None, settings()).unwrap().next_frame().unwrap().is_some());
}

/// Nodes that may not be opened.
struct Locked(SimulatedVideo);

impl Video for Locked {
    fn list(&self) -> Result<Vec<NodeInfo>, TransportError> {
        self.0.list()
    }

    fn open(&self, node: &Path) -> Result<Box<dyn VideoNode>, TransportError> {
        Err(TransportError::NodePermission { node: node.into(), advice: udev::advice(0x8086) })
    }
}

#[test]
fn a_camera_that_may_not_be_opened_is_reported_with_the_rule() {
    let (bus, ..) = plugged(pattern(Wire::Bulk));
    let error = Realsense::open(&Locked(SimulatedVideo::new(bus)), None, settings()).err().unwrap().to_string();
    assert!(error.contains("permission") && error.contains("idVendor}==\"8086\""), "{error}");
}
