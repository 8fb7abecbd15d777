//! Layers that cut through one another, stacked.

use nalgebra::Point3;
use toile_character::Pose;
use toile_garments::{GarmentError, StackSettings, stack};
use toile_geometry::{Mesh, bvh::Bvh, intersection::crossings};

use crate::column::*;

/// A closed body, a shirt that cuts in and out of it, and a coat that cuts in and out of both.
pub fn crossing_layers() -> (Mesh, Vec<Mesh>) {
    let mut body = bare();
    let rings = body.positions.len() as u32 / 150;
    for (row, y) in [(0, 0.0), (rings - 1, HEIGHT)] {
        let center = body.positions.len() as u32;
        body.positions.push(Point3::new(0.0, y, 0.0));
        body.colors.push(SKIN);
        for i in 0..150 {
            let (a, b) = (row * 150 + i, row * 150 + (i + 1) % 150);
            body.triangles.push(if row == 0 { [center, b, a] } else { [center, a, b] });
        }
    }
    let band = |lo: f32, hi: f32, radius: &dyn Fn(f32, f32) -> f32| {
        let full = column(radius, |_| BLUE);
        full.filter_triangles(|t| full.triangles[t].iter().all(|&v| (lo..hi).contains(&full.positions[v as usize].y))).0
    };
    let shirt = band(0.3, 0.9, &|y, a| RADIUS + 0.001 + 0.004 * (y * 60.0).sin() * (3.0 * a).cos());
    let coat = band(0.2, 0.95, &|y, a| RADIUS + 0.003 + 0.005 * (y * 45.0 + 2.0 * a).cos());
    (body, vec![shirt, coat])
}

#[test]
fn stacked_layers_have_their_gap_and_cross_nowhere() {
    let (body, mut layers) = crossing_layers();
    let before = layers.clone();
    let report = stack(&body, &mut layers, &[0.001; 2], &StackSettings::default(), &|_| ()).unwrap();
    for (k, layer) in report.layers.iter().enumerate() {
        assert!(layer.settled && layer.crossing_pairs == 0, "layer {k}: {layer:?}");
        assert!(layer.least_gap_m >= 0.001, "layer {k}: {layer:?}");
        assert!((layer.gaps.iter().sum::<f32>() - 1.0).abs() < 1e-3 && layer.gaps[0] == 0.0, "{:?}", layer.gaps);
        assert!(layer.self_crossings[1] <= layer.self_crossings[0]);
    }
    let all = [&body, &layers[0], &layers[1]];
    for (i, lower) in all.iter().enumerate() {
        let bvh = Bvh::new(&lower.positions, &lower.triangles);
        for upper in &all[i + 1..] {
            let bvh_upper = Bvh::new(&upper.positions, &upper.triangles);
            assert!(crossings(upper, &bvh_upper, lower, &bvh).is_empty());
        }
    }
    let mean = |k: usize| {
        let sum: f32 = before[k].positions.iter().zip(&layers[k].positions).map(|(a, b)| (a - b).norm()).sum();
        sum / before[k].positions.len() as f32
    };
    assert!(mean(0) < 0.004 && mean(1) < 0.006, "{} {}", mean(0), mean(1));
}

#[test]
fn thicker_cloth_lies_higher_and_still_crosses_nowhere() {
    let mut gaps = Vec::new();
    for thickness in [0.0, 0.003, 0.005] {
        let (body, mut layers) = crossing_layers();
        let report = stack(&body, &mut layers, &[0.0, thickness], &StackSettings::default(), &|_| ()).unwrap();
        let [shirt, coat] = &report.layers[..] else { panic!("{report:?}") };
        assert!(shirt.settled && coat.settled && coat.crossing_pairs == 0, "{thickness}: {report:?}");
        assert_eq!((shirt.gap_m, coat.gap_m), (0.0015, thickness.max(0.0015)));
        assert!(shirt.least_gap_m >= 0.0012 && coat.least_gap_m >= 0.8 * coat.gap_m, "{thickness}: {coat:?}");
        gaps.push(coat.least_gap_m);
    }
    assert!(gaps[0] < 0.003 && gaps.windows(2).all(|pair| pair[1] > pair[0]), "{gaps:?}");
}

#[test]
fn every_layer_needs_a_thickness() {
    let (body, mut layers) = crossing_layers();
    let refused = stack(&body, &mut layers, &[0.001], &StackSettings::default(), &|_| ());
    assert!(matches!(refused, Err(GarmentError::Mismatch(_))), "{refused:?}");
}

#[test]
fn layers_that_are_apart_stay_to_the_bit() {
    let body = crossing_layers().0;
    let far = column(|_, _| RADIUS + 0.03, |_| BLUE);
    let mut layers = vec![far.clone()];
    stack(&body, &mut layers, &[0.001], &StackSettings::default(), &|_| ()).unwrap();
    assert_eq!(layers[0].positions, far.positions);
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let (person, pose, before, scan) = (person(), Pose::identity(), bare(), dressed(0.01, BLUE));
            let found = extracted(&take(&person, &scan, &before, &pose));
            let (body, mut layers) = crossing_layers();
            stack(&body, &mut layers, &[0.001; 2], &StackSettings::default(), &|_| ()).unwrap();
            (found.garment, found.weights, layers)
        })
    };
    assert_eq!(run(1), run(2));
}
