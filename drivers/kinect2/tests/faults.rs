//! Every fault that a Kinect v2 can have, and what the driver reports.
#![allow(missing_docs)]

mod common;

use std::time::Instant;

use common::{PATTERN, color_fault, depth_fault, faulty, has_color_of, has_depth_of, plugged, settings};
use toile_capture::Source;
use toile_driver_kinect2::{Health, Kinect2, Settings};
use toile_driver_simulated::{
    kinect2::{CommandFault, Content, Fault, SimulatedCamera, StreamFault},
    trials::take,
};

/// Frame 2 lacks what a fault spoils; its neighbours are whole.
fn spoils_frame_2(fault: Fault, keeps: (bool, bool)) -> Health {
    let mut kinect = faulty(&[fault]);
    let (frames, error) = take(&mut kinect, 5);
    assert!(error.is_none(), "{fault:?}: {error:?}");
    for (frame, k) in frames.iter().zip(0..) {
        assert_eq!((frame.device_frame, frame.lost_before), (k, 0), "{fault:?}");
        assert_eq!(frame.depth.is_some(), k != 2 || keeps.0, "{fault:?} in frame {k}");
        assert_eq!(frame.color.is_some(), k != 2 || keeps.1, "{fault:?} in frame {k}");
        assert!(frame.depth.is_none() || has_depth_of(frame, k), "{fault:?} in frame {k}");
        assert!(frame.color.is_none() || has_color_of(frame, k), "{fault:?} in frame {k}");
    }
    kinect.health()
}

fn spoils_depth(what: StreamFault, packet: usize) -> Health {
    let health = spoils_frame_2(depth_fault(2, packet, what), (false, true));
    assert_eq!(health.alone, [0, 1], "{what:?}");
    health
}

fn spoils_color(what: StreamFault, transfer: usize) -> Health {
    let health = spoils_frame_2(color_fault(2, transfer, what), (true, false));
    assert_eq!(health.alone, [1, 0], "{what:?}");
    health
}

#[test]
fn lost_depth_packets_cost_their_frame_only() {
    // Nine packets an image, the last one short; the first and the last image of the frame.
    for (packet, count) in [(0, 1), (4, 2), (8, 1), (40, 1), (81, 1), (89, 1), (5, 60)] {
        let depth = spoils_depth(StreamFault::Lost(count), packet).depth;
        assert!(depth.torn_frames == 1 && (depth.bad > 0 || count == 60), "{packet}: {depth:?}");
    }
}

#[test]
fn damaged_depth_packets_are_counted() {
    let depth = spoils_depth(StreamFault::Damaged(3), 12).depth;
    assert_eq!((depth.packets, depth.torn_frames), (3, 1));
}

#[test]
fn short_long_and_mislabelled_depth_packets_are_bad() {
    for (what, packet) in [
        (StreamFault::Short(700), 3),
        (StreamFault::Short(1), 0),
        (StreamFault::Short(28_000), 8),
        (StreamFault::Long(4), 8),
        (StreamFault::BadEnd, 8),
        (StreamFault::BadEnd, 89),
    ] {
        let depth = spoils_depth(what, packet).depth;
        assert!(depth.bad > 0 && depth.torn_frames == 1, "{what:?} at {packet}: {depth:?}");
    }
}

#[test]
fn a_torn_depth_frame_is_dropped_and_the_next_one_is_whole() {
    assert_eq!(spoils_depth(StreamFault::Torn, 44).depth.torn_frames, 1);
}

#[test]
fn late_packets_are_not_a_loss() {
    let mut kinect = faulty(&[depth_fault(1, 40, StreamFault::Late(5)), color_fault(2, 0, StreamFault::Late(60))]);
    let (frames, _) = take(&mut kinect, 5);
    assert!(frames.iter().zip(0..).all(|(f, k)| has_depth_of(f, k) && has_color_of(f, k) && f.lost_before == 0));
}

#[test]
fn spoilt_colour_leaves_depth_alone() {
    for (what, transfer) in [
        (StreamFault::Lost(1), 0),
        (StreamFault::Lost(1), 1),
        (StreamFault::Damaged(1), 1),
        (StreamFault::Damaged(2), 0),
        (StreamFault::Short(100), 1),
        (StreamFault::Short(3), 0),
        (StreamFault::Torn, 1),
        (StreamFault::BadBegin, 0),
    ] {
        let color = spoils_color(what, transfer).color;
        assert!(color.packets + color.bad + color.torn_frames > 0, "{what:?}: {color:?}");
    }
}

/// Bytes too many, or others, in an image's last transfer.
#[test]
fn colour_that_does_not_end_as_it_should_is_dropped() {
    // What stands around the JPEG is 84 bytes in frame 2; a transfer has 16 KiB.
    let last = (PATTERN.clone().jpeg(2).len().next_multiple_of(4) + 84 - 1) / 0x4000;
    for what in [StreamFault::Long(9), StreamFault::BadEnd] {
        let color = spoils_color(what, last).color;
        assert!(color.bad + color.torn_frames > 0, "{what:?}: {color:?}");
    }
}

#[test]
fn one_silent_stream_leaves_the_other_unpaired_and_counted() {
    let mut kinect = faulty(&[color_fault(2, 0, StreamFault::Silent)]);
    let (frames, error) = take(&mut kinect, 6);
    assert!(error.is_none(), "{error:?}");
    assert!(frames.iter().zip(0..).all(|(f, k)| has_depth_of(f, k) && f.color.is_some() == (k < 2)));
    assert_eq!((kinect.health().alone, kinect.health().restarts), ([4, 0], 0));
}

#[test]
fn a_lost_pair_is_a_lost_frame() {
    let lost = StreamFault::Lost(1);
    let mut kinect = faulty(&[color_fault(1, 0, lost), depth_fault(3, 9, lost), color_fault(3, 0, lost)]);
    let (frames, _) = take(&mut kinect, 4);
    let stated = frames.iter().map(|f| (f.device_frame, f.lost_before, f.depth.is_some(), f.color.is_some()));
    let stated: Vec<_> = stated.collect();
    assert_eq!(stated, [(0, 0, true, true), (1, 0, true, false), (2, 0, true, true), (4, 1, true, true)]);
    assert_eq!((kinect.health().lost_frames, kinect.health().alone), (1, [1, 0]));
}

#[test]
fn a_stalled_colour_stream_ends_the_take_in_words() {
    let mut kinect = faulty(&[color_fault(3, 0, StreamFault::Stall)]);
    let (frames, error) = take(&mut kinect, 9);
    assert!(frames.len() >= 3 && error.unwrap().to_string().contains("colour stream: the device refused"));
    assert!(kinect.next_frame().unwrap().is_none());
}

#[test]
fn a_silent_stream_is_restarted_once_and_then_reported() {
    let mut kinect = faulty(&[depth_fault(2, 40, StreamFault::Silent), color_fault(2, 0, StreamFault::Silent)]);
    let (frames, error) = take(&mut kinect, 6);
    assert!(error.is_none(), "{error:?}");
    assert_eq!(kinect.health().restarts, 1);
    assert!(frames.iter().all(|f| f.depth.is_none() || has_depth_of(f, f.device_frame)));
    let lost: u64 = frames.iter().map(|f| u64::from(f.lost_before)).sum();
    assert!(lost >= 1 && lost == kinect.health().lost_frames, "{lost}");
    // A camera that stays silent.
    let silent = (2..60).flat_map(|k| [depth_fault(k, 0, StreamFault::Silent), color_fault(k, 0, StreamFault::Silent)]);
    let mut kinect = faulty(&silent.collect::<Vec<_>>());
    let (frames, error) = take(&mut kinect, 12);
    assert_eq!(frames.len(), 2);
    assert!(error.unwrap().to_string().contains("no frame for 0.1 s"));
    assert!(kinect.next_frame().unwrap().is_none());
}

#[test]
fn nonsense_numbers_lose_nothing_and_nonsense_times_their_picture_only() {
    for (what, keeps) in [
        (StreamFault::Sequence(1_000_000), true),
        (StreamFault::Sequence(60), true),
        (StreamFault::Time(160_000), false),
    ] {
        spoils_frame_2(depth_fault(2, 0, what), (keeps, true));
    }
}

#[test]
fn an_unplug_gives_all_whole_frames_then_one_error_then_the_end() {
    for fault in [depth_fault(3, 50, StreamFault::Unplug), color_fault(3, 1, StreamFault::Unplug)] {
        let mut kinect = faulty(&[fault]);
        let (frames, error) = take(&mut kinect, 12);
        assert!(frames.len() >= 3 && frames[..3].iter().zip(0..).all(|(f, k)| has_depth_of(f, k)));
        assert!(error.unwrap().to_string().contains("unplugged"));
        assert!(kinect.next_frame().unwrap().is_none());
    }
}

#[test]
fn firmware_that_answers_nonsense_is_refused_in_words() {
    for (fault, words) in [
        (CommandFault::Stall, "refused"),
        (CommandFault::Silence, "no answer in 50 ms"),
        (CommandFault::BadMagic, "instead of its completion"),
        (CommandFault::BadSequence, "of request 1 instead of 0"),
        (CommandFault::Premature, "completed without an answer"),
        (CommandFault::Short, "bytes instead of"),
        (CommandFault::Nonsense, "serial number cannot be read"),
        (CommandFault::NonsenseCalibration, "focal length is NaN"),
        (CommandFault::Slow(u32::MAX), "waiting for the camera to be ready: no answer in 60 ms"),
    ] {
        let mut model = SimulatedCamera::new(PATTERN.clone());
        model.set_command_fault(Some(fault));
        let (bus, ..) = plugged(model);
        let start = Instant::now();
        let error = Kinect2::open(&bus, None, settings()).err().map(|e| e.to_string()).unwrap_or_default();
        assert!(error.contains(words), "{fault:?}: {error}");
        assert!(start.elapsed().as_secs() < 5);
    }
}

#[test]
fn a_camera_that_is_slow_to_be_ready_is_waited_for() {
    let mut model = SimulatedCamera::new(PATTERN.clone());
    model.set_command_fault(Some(CommandFault::Slow(2)));
    let (bus, ..) = plugged(model);
    // As patient as the driver is by itself: the machine may be busy.
    let Settings { command_limit, ready_limit, .. } = Settings::default();
    let settings = Settings { command_limit, ready_limit, ..settings() };
    assert!(Kinect2::open(&bus, None, settings).unwrap().next_frame().unwrap().is_some());
}
