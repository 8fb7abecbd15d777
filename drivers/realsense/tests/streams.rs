//! In every mode the pictures that arrive are those that the model sent, pixel by pixel.
#![allow(missing_docs)]

mod common;

use common::{SIZE, has_color_of, has_depth_of, pattern, plugged, settings};
use nalgebra::Point3;
use toile_capture::{ClockDomain, ColorImage, Source};
use toile_driver_realsense::{Controls, Exposure, Realsense, Settings, VideoMode, list};
use toile_driver_simulated::{
    d435::{self, Content, Optics, Pattern, Rendered},
    uvc::Wire,
};
use toile_driver_transport::simulated::SimulatedVideo;
use toile_synthetic::{Subject, SyntheticSettings, sensor::SensorPreset};

#[test]
fn forty_frames_are_identical_and_none_is_lost_by_bulk_and_isochronous() {
    for (wire, is_whole) in [(Wire::Bulk, false), (Wire::Isochronous, false), (Wire::Isochronous, true)] {
        let (bus, ..) = plugged(pattern(wire));
        let video = if is_whole { SimulatedVideo::with_whole_headers(bus) } else { SimulatedVideo::new(bus) };
        let mut camera = Realsense::open(&video, None, settings()).unwrap();
        for k in 0..40 {
            let frame = camera.next_frame().unwrap().unwrap();
            assert!(has_depth_of(&frame, k) && has_color_of(&frame, k), "{wire:?} frame {k}");
            assert_eq!((frame.index, frame.device_frame, frame.lost_before), (k, k, 0));
            assert_eq!(frame.device_time_ns, (k * 1_000_000 / 30 * 1000) as i64);
        }
        let health = camera.health();
        assert_eq!((health.frames, health.lost_frames, health.lost_pictures), (40, 0, [0; 2]));
        assert_eq!((health.alone, health.broken, health.without_time, health.restarts), ([0; 2], 0, 0, 0));
    }
}

#[test]
fn a_camera_and_its_nodes_are_found_and_it_is_left_switched_off() {
    let (bus, _, model) = plugged(pattern(Wire::Isochronous));
    let video = SimulatedVideo::new(bus);
    let found = list(&video).unwrap();
    assert_eq!((found.len(), found[0].name, found[0].serial.as_str()), (1, "RealSense D435", "827313080543"));
    let nodes = [&found[0].depth, &found[0].infrared, &found[0].color].map(|n| n.clone().unwrap());
    let paths = nodes.map(|n| [n.pictures, n.metadata.unwrap()].map(|p| p.display().to_string()));
    let expected = [[0, 1], [2, 3], [4, 5]].map(|pair| pair.map(|n| format!("/dev/video{n}")));
    assert_eq!(paths, expected);
    // By the number that is printed on it, and by its USB device's.
    let printed = model.lock().unwrap().scene().monitor.serial();
    for serial in [printed.as_str(), "827313080543"] {
        let camera = Realsense::open(&video, Some(serial), settings()).unwrap();
        let identity = camera.rig().sensors[0].identity.clone();
        assert_eq!((identity.serial.as_str(), identity.firmware.as_str()), (printed.as_str(), "5.12.7.100"));
        assert_eq!((identity.model.as_str(), identity.clock), ("RealSense D435", ClockDomain::Device));
        assert_eq!(model.lock().unwrap().streaming(), 2);
        drop(camera);
        assert_eq!(model.lock().unwrap().streaming(), 0);
    }
    let error = Realsense::open(&video, Some("B8"), settings()).err().unwrap().to_string();
    assert!(error.contains("B8") && error.contains("not plugged in"), "{error}");
}

#[test]
fn lenses_and_places_are_those_of_the_tables() {
    let truth = Optics::default();
    let (bus, ..) = plugged(pattern(Wire::Bulk));
    let camera = Realsense::open(&SimulatedVideo::new(bus), None, settings()).unwrap();
    let sensor = &camera.rig().sensors[0];
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-4, "{a} {b}");
    let (depth, color) = (sensor.depth, sensor.color.unwrap());
    [depth.fx, depth.fy].into_iter().for_each(|f| near(f, truth.focal));
    near(depth.cx, truth.center[0]);
    near(depth.cy, truth.center[1]);
    [color.fx, color.fy].into_iter().for_each(|f| near(f, truth.color_focal));
    near(color.cx, truth.color_center[0]);
    near(color.cy, truth.color_center[1]);
    near(camera.calibration().baseline().unwrap(), truth.baseline);
    // Depth registered to colour, within a hundredth of a pixel (half a pixel is asked for).
    for (u, v, z) in [(10.0, 20.0, 0.6), (320.0, 240.0, 1.5), (630.0, 470.0, 4.0)] {
        let point = Point3::new((u - truth.center[0]) / truth.focal * z, (v - truth.center[1]) / truth.focal * z, z);
        let seen = truth.color_from_depth_rotation * point.coords + truth.color_from_depth_translation;
        let expected = [0, 1].map(|i| truth.color_focal * seen[i] / seen.z + truth.color_center[i]);
        let ours = color.project(&(sensor.color_from_depth * depth.unproject(u, v, z))).unwrap();
        assert!((ours.x - expected[0]).abs() < 0.01 && (ours.y - expected[1]).abs() < 0.01, "{ours} {expected:?}");
    }
    // Another size sees the same.
    let wide = camera.calibration().depth_camera(848, 480).unwrap();
    near((wide.cx - 0.0) / wide.fx, depth.cx / depth.fx);
}

#[test]
fn the_infrared_pair_comes_beside_depth_and_as_a_sensor_of_its_own() {
    let (bus, ..) = plugged(pattern(Wire::Isochronous));
    let settings = Settings { video: VideoMode::Infrared, ..settings() };
    let mut camera = Realsense::open(&SimulatedVideo::new(bus), None, settings).unwrap();
    let rig = camera.rig().clone();
    assert_eq!(rig.sensors.len(), 2);
    assert!((rig.sensors[1].rig_from_depth.translation.x - 0.05).abs() < 1e-6);
    for k in 0..6 {
        let frame = camera.next_frame().unwrap().unwrap();
        let (sensor, number) = (k % 2, k / 2);
        assert_eq!((frame.sensor, frame.device_frame, frame.lost_before), (sensor as usize, number, 0));
        let Some(ColorImage::Rgb(image)) = &frame.color else { panic!("no infrared") };
        let truth = Pattern::default().infrared(number, SIZE);
        assert!(image.pixels.iter().zip(truth).all(|(p, pair)| *p == [pair[sensor as usize]; 3]));
        assert_eq!(frame.depth.is_some(), sensor == 0);
        assert!(sensor == 1 || has_depth_of(&frame, number));
    }
}

/// The D405 has no colour part and depth in tenths of a millimetre.
#[test]
fn a_camera_without_colour_gives_depth_alone_in_its_own_unit() {
    let (bus, ..) = plugged(d435::d405(Pattern::default(), Wire::Isochronous));
    let video = SimulatedVideo::new(bus);
    let found = &list(&video).unwrap()[0];
    assert_eq!((found.name, found.has_color_part(), found.color.is_some()), ("RealSense D405", false, false));
    let mut camera = Realsense::open(&video, None, settings()).unwrap();
    let sensor = camera.rig().sensors[0].clone();
    assert_eq!((sensor.depth_scale, sensor.color, sensor.identity.model.as_str()), (1e-4, None, "RealSense D405"));
    for k in 0..5 {
        let frame = camera.next_frame().unwrap().unwrap();
        assert!(has_depth_of(&frame, k) && frame.color.is_none());
    }
}

#[test]
fn controls_are_set_and_read() {
    let (bus, _, model) = plugged(pattern(Wire::Bulk));
    let controls = Controls {
        laser: Some(false),
        laser_power: Some(240),
        exposure: Some(Exposure::Microseconds(7000)),
        preset: Some(3),
    };
    let settings = Settings { controls, video: VideoMode::Off, ..settings() };
    let mut camera = Realsense::open(&SimulatedVideo::new(bus), None, settings).unwrap();
    assert_eq!(camera.controls().unwrap(), controls);
    let stated = |selector| model.lock().unwrap().scene().monitor.control(selector).unwrap().to_vec();
    assert_eq!([stated(2), stated(4), stated(0x0b), stated(6)], [vec![0], vec![240, 0], vec![0], vec![3]]);
    assert_eq!(stated(3), 7000u32.to_le_bytes());
    assert!(camera.next_frame().unwrap().unwrap().color.is_none());
}

#[test]
fn a_rendered_person_arrives_as_rendered() {
    let settings =
        SyntheticSettings { sensor: SensorPreset::Stereo, frames: 3, garments: vec![], ..SyntheticSettings::default() };
    let person = Subject::new(&settings).unwrap();
    let mut truth = Rendered::new(person.take(0).unwrap());
    let (bus, ..) = plugged(d435::model(Rendered::new(person.take(0).unwrap()), Wire::Isochronous));
    let mut camera = Realsense::open(&SimulatedVideo::new(bus), None, common::settings()).unwrap();
    for k in 0..2 {
        let frame = camera.next_frame().unwrap().unwrap();
        let (depth, color) = truth.frame(k).clone();
        assert!(depth.iter().filter(|d| **d > 0).count() > 10_000);
        assert_eq!(frame.depth.unwrap().values, depth);
        let Some(ColorImage::Rgb(image)) = &frame.color else { panic!("no colour") };
        // Two pixels share a colour on the way; brightness is each one's own.
        let grey = |p: &[u8; 3]| 0.299 * f64::from(p[0]) + 0.587 * f64::from(p[1]) + 0.114 * f64::from(p[2]);
        let worst = image.pixels.iter().zip(&color).step_by(2).map(|(a, b)| (grey(a) - grey(b)).abs());
        assert!(worst.fold(0.0, f64::max) < 3.0);
    }
}
