//! Scenes for the decoder, and what it is to agree in with others.
#![allow(dead_code, missing_docs, clippy::unwrap_used)]

use std::sync::Arc;

use toile_driver_kinect2::Calibration;
use toile_driver_simulated::kinect2::{
    Content, Optics, Pattern, Rendered,
    phases::{self, Lit},
};
use toile_synthetic::{Subject, SyntheticSettings, sensor::SensorPreset};

pub const COLUMNS: usize = 512;
pub const ROWS: usize = 424;
/// Standard deviation of a measurement.
pub const NOISE: f64 = 6.0;

/// A scene and the part of it that is kept: left, top, width, height.
pub struct Scene {
    pub name: &'static str,
    pub make: fn() -> (Optics, Arc<Vec<u8>>),
    pub part: [usize; 4],
}

pub const SCENES: &[Scene] = &[
    Scene { name: "person", make: person, part: [170, 60, 160, 240] },
    Scene { name: "waves", make: waves, part: [300, 20, 200, 180] },
];

pub fn person_content(noise: f64) -> Rendered {
    let settings = SyntheticSettings {
        sensor: SensorPreset::Kinect2,
        frames: 2,
        garments: vec![],
        noise: false,
        ..SyntheticSettings::default()
    };
    Rendered::new(Subject::new(&settings).unwrap().take(0).unwrap(), noise)
}

fn person() -> (Optics, Arc<Vec<u8>>) {
    let mut content = person_content(NOISE);
    (content.optics(), content.depth(0))
}

/// A bent lens, noise, dark, far and blinding places.
fn waves() -> (Optics, Arc<Vec<u8>>) {
    let optics = Optics::default();
    let seen = |i: usize| {
        let (u, v) = (i % COLUMNS, i / COLUMNS);
        let seen = Pattern::seen(3, u, v);
        let blinding = (330..350).contains(&u) && (150..170).contains(&v);
        Lit { light: if blinding { 25_000.0 } else { seen.light }, ..seen }
    };
    let seen: Vec<Lit> = (0..COLUMNS * ROWS).map(seen).collect();
    let noise = |i: usize, k: usize| NOISE * 1.7 * (((i * 9 + k) as f64 * 12.9898).sin() * 43_758.545_3).fract();
    (optics, Arc::new(phases::packet(&optics, &seen, noise)))
}

/// The camera's answers, and the calibration that they are.
pub fn calibration(optics: Optics) -> ([Vec<u8>; 3], Calibration) {
    let answers = optics.answers();
    let [depth, color, p0] = &answers;
    let calibration = Calibration::parse(depth, color, p0).unwrap();
    (answers, calibration)
}

pub fn crop(image: &[f32], [left, top, width, height]: [usize; 4]) -> Vec<f32> {
    (top..top + height).flat_map(|y| image[y * COLUMNS + left..][..width].to_vec()).collect()
}

/// How two depth images agree.
#[derive(Debug)]
pub struct Agreement {
    /// Pixels that both answer or both leave out, as a share of all.
    pub mask: f64,
    /// Pixels within a millimetre, as a share of those that both answer.
    pub within_1_mm: f64,
    /// Mean difference of those, millimetres.
    pub mean_mm: f64,
    /// Pixels that both answer.
    pub both: usize,
}

pub fn agreement(ours: &[f32], theirs: &[f32]) -> Agreement {
    let same = ours.iter().zip(theirs).filter(|(a, b)| (**a > 0.0) == (**b > 0.0)).count();
    let both: Vec<f64> = ours
        .iter()
        .zip(theirs)
        .filter(|(a, b)| **a > 0.0 && **b > 0.0)
        .map(|(a, b)| f64::from((a - b).abs()))
        .collect();
    let near: Vec<f64> = both.iter().copied().filter(|mm| *mm <= 1.0).collect();
    Agreement {
        mask: same as f64 / ours.len() as f64,
        within_1_mm: near.len() as f64 / both.len().max(1) as f64,
        mean_mm: near.iter().sum::<f64>() / near.len().max(1) as f64,
        both: both.len(),
    }
}
