//! A side-by-side camera made of code behind a video node: what arrives, and every fault that it can have.
#![allow(clippy::unwrap_used)] // helpers of tests are not seen as tests

mod scene;

use std::sync::{Arc, Mutex};

use toile_capture::{RgbImage, Source};
use toile_driver_simulated::{
    side_by_side::{self, Views},
    uvc::{Fault, StreamFault, Wire},
};
use toile_driver_stereo::{Cameras, NodePictures, Pictures, Side, SideBySide, StereoCamera, StereoSettings, nodes};
use toile_driver_transport::simulated::{SimulatedBus, SimulatedVideo};
use toile_stereo::DepthSettings;

/// Both views of the scene, as brightness; frames differ in their first pixel.
struct Scene;

impl Views for Scene {
    fn size(&self) -> (u16, u16) {
        (2 * scene::SIZE.0 as u16, scene::SIZE.1 as u16)
    }

    fn brightness(&mut self, frame: u64) -> Vec<u8> {
        let (left, right) = scene::pictures();
        let width = scene::SIZE.0 as usize;
        let rows = left.pixels.chunks(width).zip(right.pixels.chunks(width));
        let mut bytes: Vec<u8> = rows.flat_map(|(l, r)| l.iter().chain(r).map(|p| p[1])).collect();
        bytes[0] = 16 + (frame % 200) as u8;
        bytes
    }
}

/// YUYV without colour, converted: brightness from 16..235 to 0..255.
fn shown(brightness: &[u8]) -> Vec<[u8; 3]> {
    let grey = |y: &u8| ((298 * (i32::from(*y) - 16) + 128) >> 8).clamp(0, 255) as u8;
    brightness.iter().map(|y| [grey(y); 3]).collect()
}

fn video(wire: Wire, faults: &[Fault]) -> SimulatedVideo {
    let bus = SimulatedBus::default();
    bus.plug(Arc::new(Mutex::new(side_by_side::model(Scene, wire).with_faults(faults.iter().copied()))));
    SimulatedVideo::new(bus)
}

fn pictures(video: &SimulatedVideo) -> NodePictures {
    let node = nodes::list(video)[0].node.clone();
    NodePictures::open(video, &node, Side::Left, (2 * scene::SIZE.0, scene::SIZE.1)).unwrap()
}

fn fault(frame: u64, packet: usize, what: StreamFault) -> Fault {
    Fault { stream: 0, frame, packet, what }
}

/// Numbers of the next pictures, each compared with what was sent.
fn numbers(pictures: &mut NodePictures, count: usize) -> Vec<u64> {
    let next = |_| {
        let picture = pictures.next_picture().unwrap()?;
        assert_eq!(picture.image.pixels, shown(&Scene.brightness(picture.sequence)), "{}", picture.sequence);
        Some(picture.sequence)
    };
    (0..count).map_while(next).collect()
}

fn rig(pictures: NodePictures) -> StereoCamera {
    let settings = StereoSettings {
        name: "pair".into(),
        cameras: Cameras::Folder { path: "unused".into() },
        width: scene::SIZE.0,
        height: scene::SIZE.1,
        fps: 30.0,
        calibration: Vec::new(),
        metres_per_unit: 1.0,
        alpha: 0.0,
        depth: DepthSettings { near: 0.8, far: 3.0, ..DepthSettings::default() },
    };
    StereoCamera::new(Box::new(SideBySide::new(pictures)), &scene::calibration(), &settings).unwrap()
}

#[test]
fn a_wide_camera_is_seen_and_its_pictures_are_what_was_sent() {
    for wire in [Wire::Bulk, Wire::Isochronous] {
        let video = video(wire, &[]);
        let wide = nodes::list(&video);
        assert_eq!((wide.len(), wide[0].size), (1, (800, 300)));
        assert_eq!(numbers(&mut pictures(&video), 6), [0, 1, 2, 3, 4, 5]);
    }
}

#[test]
fn its_depth_is_that_of_the_same_pictures_from_anywhere() {
    let mut camera = rig(pictures(&video(Wire::Isochronous, &[])));
    let frame = camera.next_frame().unwrap().unwrap();
    let image = |side: usize| {
        let all = shown(&Scene.brightness(0));
        let width = scene::SIZE.0 as usize;
        let pixels = all.chunks(2 * width).flat_map(|row| row[side * width..][..width].to_vec()).collect();
        RgbImage { width: scene::SIZE.0, height: scene::SIZE.1, pixels }
    };
    let found = camera.depth().depth(&image(0), &image(1)).unwrap();
    assert_eq!(*frame.depth.unwrap(), found.depth);
    assert!(found.depth.values.iter().filter(|d| **d > 0).count() * 4 > 3 * found.depth.values.len());
}

#[test]
fn damaged_pictures_are_lost_ones_and_their_neighbours_are_whole() {
    for (wire, what, packet) in [
        (Wire::Isochronous, StreamFault::Lost(2), 5),
        (Wire::Isochronous, StreamFault::Damaged(1), 9),
        (Wire::Isochronous, StreamFault::Short(99), 3),
        (Wire::Isochronous, StreamFault::Torn, 30),
        (Wire::Isochronous, StreamFault::ErrorBit, 3),
        (Wire::Bulk, StreamFault::Short(5), 2),
    ] {
        let mut pictures = pictures(&video(wire, &[fault(2, packet, what)]));
        assert_eq!(numbers(&mut pictures, 4), [0, 1, 3, 4], "{what:?}");
    }
    let mut late = pictures(&video(Wire::Isochronous, &[fault(2, 5, StreamFault::Late(60))]));
    assert_eq!(numbers(&mut late, 4), [0, 1, 2, 3]);
}

#[test]
fn bytes_too_many_and_headers_that_cannot_be_cost_their_picture_only() {
    for (wire, what, packet) in [
        // Room at the end of the last packet, so that the surplus comes in one payload.
        (Wire::Isochronous, StreamFault::Long(60), 156),
        (Wire::Isochronous, StreamFault::HeaderLength(0), 4),
        (Wire::Isochronous, StreamFault::HeaderLength(250), 4),
        (Wire::Bulk, StreamFault::ErrorBit, 0),
        (Wire::Bulk, StreamFault::Torn, 3),
        (Wire::Bulk, StreamFault::Lost(1), 3),
    ] {
        let mut pictures = pictures(&video(wire, &[fault(2, packet, what)]));
        let stated = numbers(&mut pictures, 4);
        assert_eq!(stated, [0, 1, 3, 4], "{wire:?} {what:?}");
    }
}

#[test]
fn a_stream_that_is_refused_ends_the_take_in_words() {
    let mut camera = rig(pictures(&video(Wire::Bulk, &[fault(2, 5, StreamFault::Stall)])));
    assert!((0..2).all(|_| camera.next_frame().unwrap().is_some()));
    let error = camera.next_frame().unwrap_err().to_string();
    assert!(error.contains("no answer") || error.contains("refused"), "{error}");
    assert!(camera.next_frame().unwrap().is_none());
}

#[test]
fn a_size_that_the_camera_lacks_is_refused() {
    let video = video(Wire::Bulk, &[]);
    let node = nodes::list(&video)[0].node.clone();
    let opened = NodePictures::open(&video, &node, Side::Left, (1000, 300));
    let error = opened.err().map(|e| e.to_string()).unwrap_or_default();
    assert!(error.contains("800") && error.contains("1000"), "{error}");
}

#[test]
fn a_silent_camera_is_reported_and_then_the_take_ends() {
    let mut camera = rig(pictures(&video(Wire::Isochronous, &[fault(2, 5, StreamFault::Silent)])));
    assert!((0..2).all(|_| camera.next_frame().unwrap().is_some()));
    let error = camera.next_frame().unwrap_err().to_string();
    assert!(error.contains("no answer in 2000 ms"), "{error}");
    assert!(camera.next_frame().unwrap().is_none());
}

#[test]
fn an_unplug_ends_the_take_after_all_whole_pictures() {
    let mut pictures = pictures(&video(Wire::Bulk, &[fault(3, 4, StreamFault::Unplug)]));
    assert_eq!(numbers(&mut pictures, 3), [0, 1, 2]);
    assert!(pictures.next_picture().unwrap_err().to_string().contains("unplugged"));
    let mut camera = rig(self::pictures(&video(Wire::Bulk, &[fault(3, 4, StreamFault::Unplug)])));
    assert!((0..3).all(|_| camera.next_frame().unwrap().is_some()));
    assert!(camera.next_frame().unwrap_err().to_string().contains("unplugged"));
    assert!(camera.next_frame().unwrap().is_none());
}
