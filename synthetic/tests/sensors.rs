//! Statistics of the sensor models.

use toile_synthetic::sensor::{EDGE_M, NoiseSeed, SensorPreset, TrueImage, measure};

/// A wall at `far`, square to the camera, with a square plate at `near` in front of its middle third.
fn plate(preset: SensorPreset, near: f32, far: f32) -> TrueImage {
    let camera = preset.camera();
    let (width, height) = (camera.width as usize, camera.height as usize);
    let inside = |x: usize, n: usize| (n / 3..2 * n / 3).contains(&x);
    let depth = (0..width * height)
        .map(|i| if inside(i % width, width) && inside(i / width, height) { near } else { far })
        .collect();
    TrueImage { depth, cosine: vec![1.0; width * height], albedo: vec![0.3; width * height] }
}

fn noise(frame: u64) -> NoiseSeed {
    NoiseSeed { seed: 77, frame }
}

/// Root mean square error of the pixels that are answered, metres.
fn rms(preset: SensorPreset, z: f32) -> f64 {
    let truth = plate(preset, z, z);
    let errors: Vec<f64> = measure(preset, &truth, noise(0))
        .iter()
        .filter(|d| **d > 0)
        .map(|&d| f64::from(d) * 0.001 - f64::from(z))
        .collect();
    assert!(errors.len() * 10 > truth.depth.len() * 6, "{preset:?} answers too little");
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
}

#[test]
fn kinect1_gives_disparities_in_eighths() {
    let camera = SensorPreset::Kinect1.camera();
    let truth = plate(SensorPreset::Kinect1, 1.2, 2.4);
    let mut levels: Vec<u16> = measure(SensorPreset::Kinect1, &truth, noise(0));
    levels.sort_unstable();
    levels.dedup();
    levels.retain(|&d| d > 0);
    assert!(levels.len() > 4 && levels.len() < 40, "{levels:?}");
    for d in levels {
        let eighths = camera.fx * 0.075 / (f64::from(d) * 0.001) * 8.0;
        // A unit of 1 mm blurs the step by fb·8/z² mm.
        let unit = camera.fx * 0.075 * 8.0 / (f64::from(d) * 0.001).powi(2) * 0.0006;
        assert!((eighths - eighths.round()).abs() < unit, "{d} mm is {eighths} eighths");
    }
}

#[test]
fn kinect1_has_a_shadow_beside_near_things_as_wide_as_the_disparities_differ() {
    let (near, far) = (1.2, 2.4);
    let camera = SensorPreset::Kinect1.camera();
    let depth = measure(SensorPreset::Kinect1, &plate(SensorPreset::Kinect1, near, far), noise(0));
    let row = &depth[240 * 640..241 * 640];
    let expected = camera.fx * 0.075 * (1.0 / f64::from(near) - 1.0 / f64::from(far));
    let left = row[100..213].iter().filter(|d| **d == 0).count() as f64;
    let right = row[430..540].iter().filter(|d| **d == 0).count() as f64;
    assert!((left - expected).abs() < 5.0 && right < 5.0, "{left} {right} {expected}");
}

#[test]
fn kinect2_has_flying_pixels_only_on_edges() {
    let preset = SensorPreset::Kinect2;
    let truth = plate(preset, 1.5, 2.5);
    let depth = measure(preset, &truth, noise(0));
    let (width, height) = (512usize, 424usize);
    let on_edge = |i: usize| {
        let (u, v) = (i % width, i / width);
        let around = |x: usize, n: usize| x.saturating_sub(1)..(x + 2).min(n);
        around(v, height)
            .any(|y| around(u, width).any(|x| (truth.depth[y * width + x] - truth.depth[i]).abs() > EDGE_M))
    };
    let (mut flying, mut edges) = (0, 0);
    for (i, &d) in depth.iter().enumerate().filter(|(_, d)| **d > 0) {
        let error = (f32::from(d) * 0.001 - truth.depth[i]).abs();
        edges += usize::from(on_edge(i));
        if error > 0.02 {
            assert!(on_edge(i), "pixel {i} flies without an edge");
            flying += 1;
        }
    }
    assert!(flying * 5 > edges && flying * 2 < edges, "{flying} of {edges} edge pixels fly");
}

#[test]
fn noise_is_as_the_data_sheets_say() {
    let tof = [rms(SensorPreset::Kinect2, 1.0), rms(SensorPreset::Kinect2, 2.2), rms(SensorPreset::Kinect2, 4.0)];
    assert!(tof[0] < tof[1] && tof[1] < tof[2] && (0.0012..0.0025).contains(&tof[1]), "{tof:?}");
    let stereo = [rms(SensorPreset::Stereo, 1.0), rms(SensorPreset::Stereo, 2.0), rms(SensorPreset::Stereo, 4.0)];
    for pair in stereo.windows(2) {
        assert!((pair[1] / pair[0] - 4.0).abs() < 0.8, "noise grows with the square of the distance: {stereo:?}");
    }
    assert!((0.002..0.02).contains(&stereo[1]), "{stereo:?}");
}

#[test]
fn frames_differ_and_repeat() {
    let truth = plate(SensorPreset::Kinect2, 2.0, 2.5);
    let take = |frame| measure(SensorPreset::Kinect2, &truth, noise(frame));
    assert_eq!(take(3), take(3));
    assert_ne!(take(3), take(4));
}

#[test]
fn grazing_and_missing_surfaces_give_nothing() {
    for preset in SensorPreset::ALL {
        let mut truth = plate(preset, 2.0, 2.0);
        truth.cosine.fill(0.01);
        let answered = measure(preset, &truth, noise(0)).iter().filter(|d| **d > 0).count();
        assert!(answered * 5 < truth.depth.len(), "{preset:?} answers {answered}");
        truth.depth.fill(0.0);
        assert!(measure(preset, &truth, noise(0)).iter().all(|d| *d == 0));
    }
}
