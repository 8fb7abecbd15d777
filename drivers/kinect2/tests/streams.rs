//! The pictures that arrive are those that the model sent.
#![allow(missing_docs)]

mod common;

use common::{
    PATTERN, has_color_of, has_depth_of, plugged,
    scenes::{calibration, person_content},
    settings,
};
use toile_capture::{ClockDomain, ColorImage, Source};
use toile_driver_kinect2::{ColorMode, Kinect2, Registration, Settings};
use toile_driver_simulated::{
    kinect2::{Optics, Pattern, SimulatedCamera},
    trials::take,
};
use toile_synthetic::sensor::TrueImage;

#[test]
fn a_hundred_frames_are_identical_and_none_is_lost() {
    let (bus, ..) = plugged(SimulatedCamera::new(PATTERN.clone()));
    let mut kinect = Kinect2::open(&bus, None, settings()).unwrap();
    for k in 0..100 {
        let frame = kinect.next_frame().unwrap().unwrap();
        assert!(has_depth_of(&frame, k) && has_color_of(&frame, k), "frame {k}");
        assert_eq!((frame.index, frame.device_frame, frame.lost_before), (k, k, 0));
        assert_eq!(frame.device_time_ns, (k * 8000 / 30) as i64 * 125_000);
    }
    let health = kinect.health();
    assert_eq!((health.frames, health.lost_frames, health.restarts, health.alone), (100, 0, 0, [0, 0]));
    assert_eq!((health.depth, health.color), Default::default());
}

#[test]
fn the_sensor_says_who_it_is_and_the_camera_is_left_switched_off() {
    let (bus, _, model) = plugged(SimulatedCamera::new(PATTERN.clone()).with_serial("B7"));
    let kinect = Kinect2::open(&bus, Some("B7"), settings()).unwrap();
    let identity = kinect.rig().sensors[0].identity.clone();
    assert_eq!((identity.serial.as_str(), identity.firmware.as_str()), ("B7", "4.3.3913.0"));
    assert_eq!((identity.clock, identity.model.as_str()), (ClockDomain::Device, "Kinect v2"));
    assert!(model.lock().unwrap().is_streaming());
    drop(kinect);
    assert!(!model.lock().unwrap().is_streaming());
    let error = Kinect2::open(&bus, Some("B8"), settings()).err().unwrap().to_string();
    assert!(error.contains("B8") && error.contains("not plugged in"), "{error}");
}

#[test]
fn a_slow_link_is_reported_before_anything_is_asked() {
    let model = SimulatedCamera::new(PATTERN.clone()).at_speed(toile_driver_transport::LinkSpeed::High);
    let (bus, ..) = plugged(model);
    let error = Kinect2::open(&bus, None, settings()).err().unwrap().to_string();
    assert!(error.contains("USB 2") && error.contains("blue port"), "{error}");
}

#[test]
fn depth_alone_where_no_colour_is_wanted() {
    let (bus, ..) = plugged(SimulatedCamera::new(PATTERN.clone()));
    let mut kinect = Kinect2::open(&bus, None, Settings { color: ColorMode::Off, ..settings() }).unwrap();
    assert!(kinect.rig().sensors[0].color.is_none());
    let (frames, _) = take(&mut kinect, 4);
    assert!(frames.iter().zip(0..).all(|(f, k)| has_depth_of(f, k) && f.color.is_none()));
}

/// Of every depth pixel and distance: where the driver sees it in colour, and where the model's optics have it.
#[test]
fn registration_is_within_half_a_pixel_of_the_optics() {
    let mut turned = Optics::default();
    (turned.color.cy, turned.roll, turned.baseline) = (551.0, -0.01, 0.0507);
    for optics in [Optics::default(), Optics::of_synthetic_sensor(), turned] {
        let registration = Registration::new(&calibration(optics).1);
        let (camera, color_from_depth) = registration.color_camera();
        let mut worst = [0.0_f64; 2];
        for (u, v) in (0..512).step_by(13).flat_map(|u| (0..424).step_by(17).map(move |v| (u, v))) {
            for mm in [500_u16, 800, 1200, 2600, 4500] {
                let z = f64::from(mm) * 1e-3;
                let truth = optics.color_pixel(u as f64, v as f64, z).unwrap();
                let stated = registration.color_pixel(u, v, f32::from(mm)).map(f64::from);
                worst[0] = worst[0].max((stated[0] - truth[0]).hypot(stated[1] - truth[1]));
                // The colour camera of the rig says the same as the tables.
                let point = color_from_depth * optics.depth.unproject(u as f64, v as f64, z);
                let pixel = camera.project(&point).unwrap();
                worst[1] = worst[1].max((pixel.x - truth[0]).hypot(pixel.y - truth[1]));
            }
        }
        assert!(worst[0] < 0.05 && worst[1] < 0.05, "{worst:?} pixels");
    }
}

/// Colours of the pattern say where they are: red the column, green the row.
#[test]
fn registered_colours_come_from_the_place_that_the_optics_say() {
    let (bus, ..) = plugged(SimulatedCamera::new(PATTERN.clone()));
    let mut kinect = Kinect2::open(&bus, None, Settings { color: ColorMode::Registered, ..settings() }).unwrap();
    let sensor = kinect.rig().sensors[0].clone();
    assert_eq!(sensor.color, Some(sensor.depth));
    let frame = kinect.next_frame().unwrap().unwrap();
    let (depth, Some(ColorImage::Rgb(image))) = (frame.depth.unwrap(), frame.color) else { panic!("no colour") };
    let (optics, mut seen) = (Optics::default(), 0);
    for i in (0..512 * 424).filter(|&i| depth.values[i] > 0) {
        let (u, v) = ((i % 512) as f64, (i / 512) as f64);
        let [x, y] = optics.color_pixel(u, v, 1e-3 * f64::from(depth.values[i])).unwrap();
        if (1.0..1918.0).contains(&x) && (1.0..1078.0).contains(&y) {
            let truth = Pattern::color(0, x.round() as usize, y.round() as usize);
            let off = (0..3).map(|k| image.pixels[i][k].abs_diff(truth[k])).max();
            assert!(off <= Some(4), "{u} {v}: {:?}, {truth:?}", image.pixels[i]);
            seen += 1;
        }
    }
    assert!(seen > 100_000, "{seen}");
}

/// A plate at one metre before a wall at two and a half; what the colour camera sees of the plate is red, all else green.
/// The colour camera stands 5 cm aside: a strip of the wall beside the plate is hidden from it, and is not red.
#[test]
fn what_is_hidden_from_the_colour_camera_does_not_take_the_colour_of_what_hides_it() {
    let registration = Registration::new(&calibration(Optics::default()).1);
    let is_plate = |i: usize| (200..300).contains(&(i % 512)) && (100..300).contains(&(i / 512));
    let depth: Vec<f32> = (0..512 * 424).map(|i| if is_plate(i) { 1000.0 } else { 2500.0 }).collect();
    let mut colors = vec![[0, 200, 0]; 1920 * 1080];
    for i in (0..512 * 424).filter(|i| is_plate(*i)) {
        let [x, y] = registration.color_pixel(i % 512, i / 512, 1000.0).map(|c| c.round() as usize);
        for (x, y) in (x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| (x, y))) {
            colors[y * 1920 + 1919 - x] = [200, 0, 0];
        }
    }
    let image = registration.register(&depth, &colors);
    let is_red = |i: usize| image.pixels[i][0] > 40;
    let red_wall = (0..512 * 424).filter(|&i| !is_plate(i) && is_red(i)).count();
    assert_eq!(red_wall, 0, "pixels of the wall are red");
    assert!((0..512 * 424).filter(|i| is_plate(*i)).all(|i| image.pixels[i] == [200, 0, 0]));
    // The wall beside it is as green as elsewhere: no rim without colour.
    assert!((180..320).all(|u| is_plate(200 * 512 + u) || image.pixels[200 * 512 + u] == [0, 200, 0]));
}

/// A rendered person: depth within the noise of what was rendered, and not mirrored; colour as rendered.
#[test]
fn a_rendered_person_is_measured() {
    let content = person_content(6.0);
    let (truth, colors) = (content.truth(0), content.color(0));
    let (bus, ..) = plugged(SimulatedCamera::new(content));
    let mut kinect = Kinect2::open(&bus, None, settings()).unwrap();
    let frame = kinect.next_frame().unwrap().unwrap();
    let (depth, Some(ColorImage::Rgb(image))) = (frame.depth.unwrap(), frame.color) else { panic!("no colour") };
    let answered: Vec<usize> = (0..512 * 424).filter(|&i| depth.values[i] > 0 && is_inside(&truth.depth, i)).collect();
    let error = |i: usize| f64::from(depth.values[i]) - 1000.0 * f64::from(truth.depth[i]);
    // Whole millimetres, and three standard deviations.
    let fits = |i: usize| error(i).abs() <= 0.5 + 3.0 * spread_mm(content_light(&truth, i), 6.0);
    let share = answered.iter().filter(|&&i| fits(i)).count() as f64 / answered.len() as f64;
    let bias = answered.iter().map(|&i| error(i)).sum::<f64>() / answered.len() as f64;
    assert!(answered.len() > 40_000, "{}", answered.len());
    assert!(share > 0.98 && bias.abs() < 0.5, "{share} {bias}");
    let off = |a: &[u8; 3], b: &[u8; 3]| (0..3).map(|k| i32::from(a[k].abs_diff(b[k]))).sum::<i32>();
    let mean = |turned: bool| {
        let other = |i: usize| if turned { i - i % 1920 + 1919 - i % 1920 } else { i };
        let sum: i32 = (0..colors.len()).map(|i| off(&image.pixels[i], &colors[other(i)])).sum();
        f64::from(sum) / colors.len() as f64
    };
    assert!(mean(false) < 8.0 && mean(true) > 2.0 * mean(false), "{} {}", mean(false), mean(true));
}

/// True where no neighbour is more than 40 mm nearer or farther: pixels on edges see two things.
fn is_inside(depth: &[f32], i: usize) -> bool {
    let around = [i.wrapping_sub(1), i + 1, i.wrapping_sub(512), i + 512];
    around.iter().all(|&j| depth.get(j).is_some_and(|other| *other > 0.0 && (other - depth[i]).abs() < 0.04))
}

/// Light that the model gives a pixel.
fn content_light(truth: &TrueImage, i: usize) -> f64 {
    7000.0 * f64::from(truth.cosine[i] * truth.albedo[i]) / f64::from(truth.depth[i]).powi(2)
}

/// Standard deviation of depth where measurements have one of `noise`: a phasor's angle is off by √(2/3) · noise / size,
/// depth is the mean of the three, and the bilateral filter averages nine pixels (square root of its squared weights: 1/3).
fn spread_mm(light: f64, noise: f64) -> f64 {
    let of = |period: f64, gain: f64| period / std::f64::consts::TAU * (2.0_f64 / 3.0).sqrt() * noise * gain / light;
    let squares: f64 = [(3.0, 1.322_581), (15.0, 1.0), (2.0, 1.612_903)].map(|(p, g)| of(p, g).powi(2)).iter().sum();
    625.0 * squares.sqrt() / 3.0 / 3.0
}
