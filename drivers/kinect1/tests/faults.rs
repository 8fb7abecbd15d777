//! Every fault that a Kinect can have, and what the driver reports.
#![allow(missing_docs)]

mod common;

use std::time::Instant;

use common::{depth_fault, faulty, has_color_of, has_depth_of, plugged, settings, video_fault};
use toile_capture::Source;
use toile_driver_kinect1::{Kinect1, Settings};
use toile_driver_simulated::{
    kinect1::{CommandFault, Pattern, SimulatedCamera, StreamFault},
    trials::take,
};

/// Frame 2's depth is spoilt by a fault: it comes with colour alone, its neighbours are whole.
fn spoils_frame_2(what: StreamFault, packet: usize) -> Kinect1 {
    let mut kinect = faulty(&[depth_fault(2, packet, what)]);
    let (frames, error) = take(&mut kinect, 6);
    assert!(error.is_none(), "{what:?}: {error:?}");
    for (frame, k) in frames.iter().zip(0..) {
        assert_eq!((frame.device_frame, frame.lost_before), (k, 0), "{what:?}");
        assert_eq!(has_depth_of(frame, k), k != 2, "{what:?} in frame {k}");
        assert!(frame.depth.is_some() == (k != 2) && has_color_of(frame, k), "{what:?} in frame {k}");
    }
    assert_eq!(kinect.health().alone, [0, 1], "{what:?}");
    kinect
}

#[test]
fn lost_packets_are_counted_and_cost_their_frame_only() {
    for (packet, count) in [(5, 1), (0, 3), (241, 1), (10, 200)] {
        let health = spoils_frame_2(StreamFault::Lost(count), packet).health();
        assert_eq!((health.depth.packets, health.lost_frames), (count as u64, 0));
        assert_eq!(health.video, Default::default());
    }
}

#[test]
fn damaged_packets_count_as_lost() {
    assert_eq!(spoils_frame_2(StreamFault::Damaged(4), 7).health().depth.packets, 4);
}

#[test]
fn short_long_and_mislabelled_packets_are_bad() {
    for what in [
        StreamFault::Short(700),
        StreamFault::Short(12),
        StreamFault::Short(5),
        StreamFault::Long(60),
        StreamFault::BadBegin,
        StreamFault::BadFlag,
    ] {
        for packet in [0, 100, 241] {
            let depth = spoils_frame_2(what, packet).health().depth;
            assert!(depth.bad_packets + depth.packets > 0, "{what:?} at {packet}");
        }
    }
}

#[test]
fn a_torn_frame_is_dropped_and_the_next_one_is_whole() {
    let depth = spoils_frame_2(StreamFault::Torn, 120).health().depth;
    assert_eq!((depth.packets, depth.torn_frames), (0, 1));
}

#[test]
fn late_packets_are_not_a_loss() {
    let mut kinect = faulty(&[depth_fault(2, 30, StreamFault::Late(20)), video_fault(3, 0, StreamFault::Late(90))]);
    let (frames, _) = take(&mut kinect, 6);
    assert!(frames.iter().zip(0..).all(|(f, k)| has_depth_of(f, k) && has_color_of(f, k) && f.lost_before == 0));
}

#[test]
fn a_lost_colour_image_leaves_depth_alone_and_a_lost_pair_is_a_lost_frame() {
    let lost = StreamFault::Lost(1);
    let mut kinect = faulty(&[video_fault(1, 9, lost), video_fault(3, 9, lost), depth_fault(3, 9, lost)]);
    let (frames, _) = take(&mut kinect, 4);
    let stated = frames.iter().map(|f| (f.device_frame, f.lost_before, f.depth.is_some(), f.color.is_some()));
    let stated: Vec<_> = stated.collect();
    assert_eq!(stated, [(0, 0, true, true), (1, 0, true, false), (2, 0, true, true), (4, 1, true, true)]);
    let health = kinect.health();
    assert_eq!((health.lost_frames, health.alone, health.video.packets), (1, [1, 0], 2));
}

#[test]
fn a_silent_stream_is_restarted_once_and_then_reported() {
    let mut kinect = faulty(&[depth_fault(3, 40, StreamFault::Silent), video_fault(3, 40, StreamFault::Silent)]);
    let (frames, error) = take(&mut kinect, 12);
    assert!(error.is_none(), "{error:?}");
    assert_eq!(kinect.health().restarts, 1);
    let after = &frames[3];
    assert!(after.lost_before >= 3 && has_depth_of(after, after.device_frame), "{}", after.lost_before);
    // A camera that stays silent.
    let silent = (3..60).flat_map(|k| [depth_fault(k, 0, StreamFault::Silent), video_fault(k, 0, StreamFault::Silent)]);
    let mut kinect = faulty(&silent.collect::<Vec<_>>());
    let (frames, error) = take(&mut kinect, 12);
    assert_eq!(frames.len(), 3);
    assert!(error.unwrap().to_string().contains("no frame for 0.1 s"));
    assert!(kinect.next_frame().unwrap().is_none());
}

#[test]
fn a_time_that_cannot_be_costs_its_picture_only() {
    for ticks in [600_000_000, 3_000_000_000] {
        let mut kinect = faulty(&[depth_fault(2, 0, StreamFault::Time(ticks))]);
        let (frames, error) = take(&mut kinect, 6);
        assert!(error.is_none(), "{error:?}");
        for (frame, k) in frames.iter().zip(0..) {
            assert_eq!((frame.device_frame, frame.lost_before), (k, 0), "{ticks}");
            assert!(has_color_of(frame, k) && has_depth_of(frame, k) == (k != 2), "{ticks}: {k}");
        }
        assert_eq!(kinect.health().alone, [0, 1]);
    }
}

#[test]
fn an_unplug_gives_all_whole_frames_then_one_error_then_the_end() {
    let mut kinect = faulty(&[depth_fault(4, 100, StreamFault::Unplug)]);
    let (frames, error) = take(&mut kinect, 12);
    assert!(frames.len() >= 4 && frames[..4].iter().zip(0..).all(|(f, k)| has_depth_of(f, k)));
    assert!(error.unwrap().to_string().contains("unplugged"));
    assert!(kinect.next_frame().unwrap().is_none());
}

#[test]
fn firmware_that_answers_nonsense_is_refused_in_words() {
    for (fault, words) in [
        (CommandFault::Stall, "refused"),
        (CommandFault::Silence, "no answer in 50 ms"),
        (CommandFault::BadMagic, "begins with 58 58"),
        (CommandFault::BadTag, "to request"),
        (CommandFault::BadCommand, "to command"),
        (CommandFault::BadLength, "words and has"),
        (CommandFault::Short, "bytes instead of"),
        (CommandFault::Nonsense, "begins with ff ff"),
        (CommandFault::Slow(u32::MAX), "no answer in 50 ms"),
    ] {
        let mut model = SimulatedCamera::new(Pattern::default());
        model.set_command_fault(Some(fault));
        let (bus, ..) = plugged(model);
        let start = Instant::now();
        let error = Kinect1::open(&bus, None, settings()).err().map(|e| e.to_string()).unwrap_or_default();
        assert!(error.contains(words), "{fault:?}: {error}");
        assert!(start.elapsed().as_secs() < 5);
    }
}

#[test]
fn slow_answers_are_waited_for() {
    let mut model = SimulatedCamera::new(Pattern::default());
    model.set_command_fault(Some(CommandFault::Slow(3)));
    let (bus, ..) = plugged(model);
    // As patient as the driver is by itself: the machine may be busy.
    let settings = Settings { command_limit: Settings::default().command_limit, ..settings() };
    assert!(Kinect1::open(&bus, None, settings).unwrap().next_frame().unwrap().is_some());
}
