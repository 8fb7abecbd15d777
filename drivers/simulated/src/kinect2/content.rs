//! The scene before the modelled camera.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError},
};

use toile_synthetic::{Take, sensor::TrueImage};

use super::{
    COLOR_SIZE, Optics, SIZE,
    phases::{self, Lit},
};

/// The source of a modelled camera's images.
pub trait Content: Send {
    /// Depth packet of frame `frame`: ten images.
    fn depth(&mut self, frame: u64) -> Arc<Vec<u8>>;
    /// Colour of frame `frame`, a mirrored JPEG.
    fn jpeg(&mut self, frame: u64) -> Arc<Vec<u8>>;
    /// The calibration of the camera.
    fn optics(&self) -> Optics;
}

/// A frame's depth packet and JPEG.
type Images = (Arc<Vec<u8>>, Arc<Vec<u8>>);

/// Made-up images; after [`Pattern::FRAMES`] the first comes again. Clones share what is computed once.
#[derive(Debug, Clone, Default)]
pub struct Pattern {
    optics: Optics,
    frames: Arc<Mutex<BTreeMap<u64, Images>>>,
}

impl Pattern {
    /// Number of frames that differ.
    pub const FRAMES: u64 = 5;

    /// Before another camera.
    pub fn of(optics: Optics) -> Self {
        Self { optics, ..Self::default() }
    }

    /// The scene at depth pixel (`u`, `v`) in frame `frame`: waves with steps in them, dark and far places.
    pub fn seen(frame: u64, u: usize, v: usize) -> Lit {
        let (x, y, t) = (u as f64, v as f64, (frame % Self::FRAMES) as f64);
        let wave = 1.8 + 0.4 * (x / 61.0 + t).sin() + 0.3 * (y / 43.0).cos();
        let step = if (u / 64 + v / 53).is_multiple_of(2) { 0.0 } else { 0.9 };
        let far = if u > 440 && v < 120 { 3.0 } else { 0.0 };
        let dark = if (200..230).contains(&u) && v > 300 { 0.0 } else { 1.0 };
        let z = wave + step + far;
        Lit { z, light: dark * (600.0 + 300.0 * (x / 17.0).sin() * (y / 23.0).cos()) / z }
    }

    /// Colour at a place that is not mirrored: red grows along the columns, green along the rows.
    pub fn color(frame: u64, column: usize, row: usize) -> [u8; 3] {
        [(column * 255 / COLOR_SIZE.0) as u8, (row * 255 / COLOR_SIZE.1) as u8, (frame % Self::FRAMES) as u8 * 50]
    }

    fn images(&self, frame: u64) -> Images {
        let frame = frame % Self::FRAMES;
        let mut frames = self.frames.lock().unwrap_or_else(PoisonError::into_inner);
        frames
            .entry(frame)
            .or_insert_with(|| {
                let seen: Vec<Lit> = (0..SIZE.0 * SIZE.1).map(|i| Self::seen(frame, i % SIZE.0, i / SIZE.0)).collect();
                let color = |i: usize| Self::color(frame, i % COLOR_SIZE.0, i / COLOR_SIZE.0);
                let pixels: Vec<[u8; 3]> = (0..COLOR_SIZE.0 * COLOR_SIZE.1).map(color).collect();
                (Arc::new(phases::packet(&self.optics, &seen, |_, _| 0.0)), Arc::new(mirrored_jpeg(pixels)))
            })
            .clone()
    }
}

impl Content for Pattern {
    fn depth(&mut self, frame: u64) -> Arc<Vec<u8>> {
        self.images(frame).0
    }

    fn jpeg(&mut self, frame: u64) -> Arc<Vec<u8>> {
        self.images(frame).1
    }

    fn optics(&self) -> Optics {
        self.optics
    }
}

/// A synthetic person on a turning disk, rendered for both cameras; after the last frame the first follows.
pub struct Rendered {
    take: Take,
    color_take: Take,
    /// Standard deviation of a measurement.
    noise: f64,
    frames: BTreeMap<usize, Images>,
}

impl Rendered {
    /// Before this scene; its settings must ask for the Kinect v2's sensor. `noise` is the standard deviation of a
    /// measurement (real ones: about 6).
    pub fn new(take: Take, noise: f64) -> Self {
        let mut color_take = take.clone();
        color_take.room_from_camera =
            take.room_from_camera * Optics::of_synthetic_sensor().color_from_depth().inverse();
        Self { take, color_take, noise, frames: BTreeMap::new() }
    }

    /// The true depth image of frame `frame`.
    pub fn truth(&self, frame: u64) -> TrueImage {
        self.take.look(self.index(frame)).0
    }

    /// The true colours of frame `frame` as the colour camera sees them, not mirrored.
    pub fn color(&self, frame: u64) -> Vec<[u8; 3]> {
        self.color_take.look_through(&self.optics().color, self.index(frame)).1
    }

    fn index(&self, frame: u64) -> usize {
        (frame % self.take.moments.len() as u64) as usize
    }

    fn images(&mut self, frame: u64) -> Images {
        let index = self.index(frame);
        if let Some(images) = self.frames.get(&index) {
            return images.clone();
        }
        let seen = seen(&self.truth(frame));
        let noise = |pixel: usize, k: usize| self.noise * normal(frame << 40 | (pixel as u64) << 4 | k as u64);
        let packet = phases::packet(&self.optics(), &seen, noise);
        let images = (Arc::new(packet), Arc::new(mirrored_jpeg(self.color(frame))));
        self.frames.insert(index, images.clone());
        images
    }
}

impl Content for Rendered {
    fn depth(&mut self, frame: u64) -> Arc<Vec<u8>> {
        self.images(frame).0
    }

    fn jpeg(&mut self, frame: u64) -> Arc<Vec<u8>> {
        self.images(frame).1
    }

    fn optics(&self) -> Optics {
        Optics::of_synthetic_sensor()
    }
}

/// Light falls with the square of the distance, with the slope of the surface, and with its darkness.
fn seen(truth: &TrueImage) -> Vec<Lit> {
    /// Light of a white surface that faces the camera at one metre.
    const LIGHT: f64 = 7000.0;
    let pixels = truth.depth.iter().zip(&truth.cosine).zip(&truth.albedo);
    pixels
        .map(|((&z, &cosine), &albedo)| {
            let z = f64::from(z);
            let light = if z > 0.0 { LIGHT * f64::from(cosine) * f64::from(albedo) / (z * z) } else { 0.0 };
            Lit { z, light }
        })
        .collect()
}

/// A number of the normal distribution for every key: twelve uniform ones less six.
fn normal(key: u64) -> f64 {
    let mut state = key;
    let mut sum = -6.0;
    for _ in 0..12 {
        // SplitMix64 (Steele et al. 2014).
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        sum += ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64;
    }
    sum
}

/// A JPEG of pixels turned round; empty where it cannot be encoded.
fn mirrored_jpeg(mut pixels: Vec<[u8; 3]>) -> Vec<u8> {
    pixels.chunks_exact_mut(COLOR_SIZE.0).for_each(<[_]>::reverse);
    let mut bytes = Vec::new();
    let encoder = jpeg_encoder::Encoder::new(&mut bytes, 92);
    let (width, height) = (COLOR_SIZE.0 as u16, COLOR_SIZE.1 as u16);
    let encoded = encoder.encode(pixels.as_flattened(), width, height, jpeg_encoder::ColorType::Rgb);
    if encoded.is_ok() { bytes } else { Vec::new() }
}
