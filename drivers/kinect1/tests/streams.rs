//! In every mode the pictures that arrive are those that the model sent, pixel by pixel.
#![allow(missing_docs)]

mod common;

use std::sync::{Arc, Mutex};

use common::{has_color_of, has_depth_of, mm, plugged, settings};
use toile_capture::{ClockDomain, ColorImage, Source};
use toile_driver_kinect1::{DepthMode, Kinect1, Led, Motor, Settings, VideoMode};
use toile_driver_simulated::kinect1::{Content, Optics, Pattern, Rendered, SimulatedCamera, SimulatedMotor};
use toile_synthetic::{Subject, SyntheticSettings, sensor::SensorPreset};

#[test]
fn a_hundred_frames_are_identical_and_none_is_lost() {
    let (bus, ..) = plugged(SimulatedCamera::new(Pattern::default()));
    let mut kinect = Kinect1::open(&bus, None, settings()).unwrap();
    for k in 0..100 {
        let frame = kinect.next_frame().unwrap().unwrap();
        assert!(has_depth_of(&frame, k) && has_color_of(&frame, k), "frame {k}");
        assert_eq!((frame.index, frame.device_frame, frame.lost_before), (k, k, 0));
        assert_eq!(frame.device_time_ns, (k as f64 * 1e9 / 30.0) as i64);
    }
    let health = kinect.health();
    assert_eq!((health.frames, health.lost_frames, health.restarts), (100, 0, 0));
    assert_eq!((health.depth.packets, health.depth.bad_packets, health.alone), (0, 0, [0, 0]));
}

#[test]
fn the_sensor_says_who_it_is_and_the_camera_is_left_switched_off() {
    let (bus, _, model) = plugged(SimulatedCamera::new(Pattern::default()).with_serial("B7"));
    let kinect = Kinect1::open(&bus, Some("B7"), settings()).unwrap();
    let identity = kinect.rig().sensors[0].identity.clone();
    assert_eq!((identity.serial.as_str(), identity.firmware.as_str()), ("B7", "1.0b"));
    assert_eq!(identity.clock, ClockDomain::Device);
    let on = |n| model.lock().unwrap().register(n);
    assert_eq!([on(0x06), on(0x05), on(0x12)], [2, 1, 3]);
    drop(kinect);
    assert_eq!([0x06, 0x05].map(|n| model.lock().unwrap().register(n)), [0, 0]);
    let error = Kinect1::open(&bus, Some("B8"), settings()).err().unwrap().to_string();
    assert!(error.contains("B8") && error.contains("not plugged in"), "{error}");
}

#[test]
fn ten_bits_are_the_upper_ten() {
    let (bus, ..) = plugged(SimulatedCamera::new(Pattern::default()));
    let settings = Settings { depth: DepthMode::Ten, video: VideoMode::Off, ..settings() };
    let mut kinect = Kinect1::open(&bus, None, settings).unwrap();
    for k in 0..3 {
        let frame = kinect.next_frame().unwrap().unwrap();
        let truth: Vec<u16> =
            Pattern::default().depth(k).into_iter().map(|raw| if raw == 2047 { 0 } else { mm(raw & !1) }).collect();
        assert!(frame.depth.unwrap().values == truth && frame.color.is_none());
    }
}

#[test]
fn infrared_comes_as_grey_beside_the_depth() {
    let (bus, ..) = plugged(SimulatedCamera::new(Pattern::default()));
    let settings = Settings { video: VideoMode::Infrared, ..settings() };
    let mut kinect = Kinect1::open(&bus, None, settings).unwrap();
    for k in 0..3 {
        let frame = kinect.next_frame().unwrap().unwrap();
        assert!(has_depth_of(&frame, k));
        let Some(ColorImage::Rgb(image)) = frame.color else { panic!("no infrared") };
        assert_eq!((image.width, image.height), (640, 488));
        let truth = Pattern::default().infrared(k);
        assert!(image.pixels.iter().zip(truth).all(|(p, v)| *p == [(v >> 2) as u8; 3]));
    }
}

/// Of every depth pixel and distance: where the driver sees it in colour, and where the model's optics have it.
#[test]
fn registration_is_within_half_a_pixel_of_the_optics() {
    for optics in [Optics::default(), Optics::new(525.0, [316.2, 243.7]), Optics::new(531.5, [322.0, 255.4])] {
        let (bus, ..) = plugged(SimulatedCamera::new(Pattern { optics }));
        let kinect = Kinect1::open(&bus, None, settings()).unwrap();
        let sensor = &kinect.rig().sensors[0];
        let mut worst = [0.0_f64; 2];
        for (u, v) in (0..640).step_by(13).flat_map(|u| (0..480).step_by(17).map(move |v| (u, v))) {
            for mm in [500_u16, 800, 1200, 2600, 5000, 8000] {
                let z = f64::from(mm) * 1e-3;
                let truth = optics.color_pixel(u as f64, v as f64, z);
                let stated = kinect.registration().color_pixel(u, v, mm);
                worst[0] = worst[0].max((stated[0] - truth[0]).hypot(stated[1] - truth[1]));
                // The cameras of the rig say the same as the tables.
                let point = sensor.color_from_depth * sensor.depth.unproject(u as f64, v as f64, z);
                let camera = sensor.color.unwrap().project(&point).unwrap();
                worst[1] = worst[1].max((camera.x - truth[0]).hypot(camera.y - truth[1]));
            }
        }
        assert!(worst[0] < 0.1 && worst[1] < 0.1, "{worst:?} pixels");
    }
}

/// A rendered person: every pixel of the registered depth is the depth of a point that the colour camera has within
/// half a pixel of it.
#[test]
fn registered_depth_of_a_rendered_person_is_where_colour_has_it() {
    let scene = SyntheticSettings {
        sensor: SensorPreset::Kinect1,
        frames: 2,
        garments: vec![],
        noise: false,
        ..SyntheticSettings::default()
    };
    let subject = Subject::new(&scene).unwrap();
    let mut truth = Rendered::new(subject.take(0).unwrap());
    let (bus, ..) = plugged(SimulatedCamera::new(Rendered::new(subject.take(0).unwrap())));
    let open = |registered| Kinect1::open(&bus, None, Settings { registered, ..settings() }).unwrap();
    let as_measured = open(false).next_frame().unwrap().unwrap().depth.unwrap();
    let registered = open(true).next_frame().unwrap().unwrap().depth.unwrap();
    let rendered = truth.frame(0).unwrap();
    let seen: Vec<usize> = (0..640 * 480).filter(|&i| as_measured.values[i] > 0).collect();
    assert!(seen.len() > 20_000);
    // Raw steps are the sensor's: 1.5 mm at 0.7 m, 20 mm at 2.7 m, and the wall behind.
    for &i in &seen {
        let (got, true_mm) = (f64::from(as_measured.values[i]), f64::from(rendered.depth_mm[i]));
        assert!((got - true_mm).abs() <= 1.0 + 1.7e-6 * true_mm * true_mm, "{got} {true_mm}");
    }
    let optics = truth.optics();
    let mut sources = vec![Vec::new(); 640 * 480];
    for &i in &seen {
        let mm = as_measured.values[i];
        let [x, y] = optics.color_pixel((i % 640) as f64, (i / 640) as f64, f64::from(mm) * 1e-3);
        let near = |c: f64| [(c - 0.01).round(), (c + 0.01).round()];
        for (x, y) in near(x).into_iter().flat_map(|x| near(y).map(|y| (x, y))) {
            if (0.0..640.0).contains(&x) && (0.0..480.0).contains(&y) {
                sources[y as usize * 640 + x as usize].push(mm);
            }
        }
    }
    let filled: Vec<usize> = (0..640 * 480).filter(|&i| registered.values[i] > 0).collect();
    assert!(filled.len() as f64 > 0.85 * seen.len() as f64, "{} of {}", filled.len(), seen.len());
    assert!(filled.iter().all(|&i| sources[i].contains(&registered.values[i])));
}

#[test]
fn led_tilt_and_accelerometer() {
    let (bus, camera, _) = plugged(SimulatedCamera::new(Pattern::default()));
    let board = Arc::new(Mutex::new(SimulatedMotor::default()));
    bus.plug(board.clone());
    let mut motor = Motor::open(&bus, Some(&camera)).unwrap();
    motor.set_led(Led::BlinkingRedYellow).unwrap();
    assert_eq!(board.lock().unwrap().led, 6);
    for degrees in [0.0_f64, 12.5, -31.0] {
        motor.set_tilt(degrees.to_radians()).unwrap();
        let state = motor.state().unwrap();
        assert!((state.tilt.unwrap().to_degrees() - degrees).abs() < 1e-9);
        let [x, y, z] = state.acceleration;
        assert!((x * x + y * y + z * z).sqrt() - 9.806_65 < 0.02);
        assert!((y / 9.806_65 - degrees.to_radians().cos()).abs() < 2e-3);
    }
    motor.set_tilt(1.5).unwrap();
    assert_eq!(board.lock().unwrap().tilt, 62);
    board.lock().unwrap().stalls = true;
    assert!(motor.state().unwrap_err().to_string().contains("refused"));
}
