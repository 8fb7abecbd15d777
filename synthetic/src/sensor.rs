//! The depth that cameras measure in place of the true one.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use toile_geometry::camera::PinholeCamera;

use crate::random::{bits_at, normal_at, uniform_at};

/// A jump of more than this between neighbours is a depth edge, metres.
pub const EDGE_M: f32 = 0.04;
/// Metres a depth unit.
pub const DEPTH_SCALE: f64 = 0.001;

/// A depth camera to imitate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SensorPreset {
    /// Kinect v1 (structured light): 640 × 480, disparities in steps of 1/8 pixel over a 75 mm baseline, a shadow of the
    /// projector beside near things.
    Kinect1,
    /// Kinect v2 (time of flight): 512 × 424, noise of 1.5 mm growing with distance, angle and darkness, flying pixels
    /// on edges, dropouts at grazing angles.
    #[default]
    Kinect2,
    /// Active stereo (RealSense D415-like): 640 × 480, lumpy noise that grows with the square of the distance, holes on
    /// edges and where only one camera sees.
    Stereo,
}

impl SensorPreset {
    /// All presets.
    pub const ALL: [Self; 3] = [Self::Kinect1, Self::Kinect2, Self::Stereo];

    /// The name in settings, such as `kinect2`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Kinect1 => "kinect1",
            Self::Kinect2 => "kinect2",
            Self::Stereo => "stereo",
        }
    }

    /// The preset of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|p| p.name() == name)
    }

    /// Its depth camera; colour is registered to it.
    pub fn camera(self) -> PinholeCamera {
        match self {
            Self::Kinect1 => PinholeCamera::ideal(640, 480, 575.8, 575.8, 319.5, 239.5),
            Self::Kinect2 => PinholeCamera::ideal(512, 424, 365.0, 365.0, 256.0, 212.0),
            Self::Stereo => PinholeCamera::ideal(640, 480, 610.0, 610.0, 319.5, 239.5),
        }
    }

    /// Baseline between the two eyes (or projector and eye), metres; `None` for time of flight.
    pub fn baseline(self) -> Option<f64> {
        match self {
            Self::Kinect1 => Some(0.075),
            Self::Kinect2 => None,
            Self::Stereo => Some(0.055),
        }
    }

    /// Camera to axis so that a tall person fits, metres.
    pub fn usual_distance(self) -> f64 {
        match self {
            Self::Kinect1 => 2.6,
            Self::Kinect2 => 2.2,
            Self::Stereo => 2.8,
        }
    }
}

/// The true image, row by row.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TrueImage {
    /// Depth along +Z, metres; 0 where there is nothing.
    pub depth: Vec<f32>,
    /// Cosine between the ray and the surface's normal, 0..1.
    pub cosine: Vec<f32>,
    /// Linear reflectance, 0..1.
    pub albedo: Vec<f32>,
}

/// Where a frame's random numbers come from.
#[derive(Debug, Clone, Copy)]
pub struct NoiseSeed {
    /// Seed of the take.
    pub seed: u64,
    /// Index of the frame.
    pub frame: u64,
}

impl NoiseSeed {
    pub(crate) fn uniform(&self, pixel: usize, channel: u64) -> f64 {
        uniform_at(self.seed ^ channel, self.frame, pixel as u64)
    }

    pub(crate) fn normal(&self, pixel: usize, channel: u64) -> f64 {
        normal_at(self.seed ^ channel, self.frame, pixel as u64)
    }

    /// Noise in lumps of `size` pixels with standard deviation of about 1.
    pub(crate) fn lumpy(&self, u: usize, v: usize, size: f64, channel: u64) -> f64 {
        /// Standard deviation of a bilinear blend of normal numbers, averaged over its cell.
        const BLEND: f64 = 0.667;
        let (x, y) = (u as f64 / size, v as f64 / size);
        let (f, g) = (x.fract(), y.fract());
        let knot = |i: u64, j: u64| normal_at(self.seed ^ channel, self.frame, (x as u64 + i) << 20 | (y as u64 + j));
        let row = |j: u64| knot(0, j) * (1.0 - f) + knot(1, j) * f;
        (row(0) * (1.0 - g) + row(1) * g) / BLEND
    }
}

/// Depth in units of [`DEPTH_SCALE`] as the camera reports it; 0 where it gives none.
pub fn measure(preset: SensorPreset, truth: &TrueImage, noise: NoiseSeed) -> Vec<u16> {
    let camera = preset.camera();
    let image = Image { truth, width: camera.width as usize, height: camera.height as usize };
    let hidden = preset.baseline().map(|b| image.hidden_from_second_eye(camera.fx * b));
    (0..truth.depth.len())
        .into_par_iter()
        .map(|i| {
            if truth.depth[i] <= 0.0 || hidden.as_ref().is_some_and(|h| h[i]) {
                return 0;
            }
            let z = match preset {
                SensorPreset::Kinect1 => image.structured_light(i, camera.fx * 0.075, noise),
                SensorPreset::Kinect2 => image.time_of_flight(i, noise),
                SensorPreset::Stereo => image.stereo(i, camera.fx * 0.055, noise),
            };
            z.map_or(0, to_units)
        })
        .collect()
}

/// Depth without noise in units; 0 where there is nothing.
pub fn exact(truth: &TrueImage) -> Vec<u16> {
    truth.depth.iter().map(|&z| if z > 0.0 { to_units(f64::from(z)) } else { 0 }).collect()
}

fn to_units(z: f64) -> u16 {
    (z / DEPTH_SCALE).round().clamp(0.0, 65_535.0) as u16
}

struct Image<'a> {
    truth: &'a TrueImage,
    width: usize,
    height: usize,
}

impl Image<'_> {
    fn at(&self, i: usize) -> (usize, usize) {
        (i % self.width, i / self.width)
    }

    /// Of the eight neighbours, one beyond a depth edge: a random one, so that flying pixels go both ways. The inner
    /// option is `None` where nothing is seen there.
    fn beyond_edge(&self, i: usize, pick: u64) -> Option<Option<f32>> {
        let (u, v) = self.at(i);
        let z = self.truth.depth[i];
        let mut found = Vec::with_capacity(8);
        for dv in -1..=1isize {
            for du in -1..=1isize {
                let (x, y) = (u as isize + du, v as isize + dv);
                if x < 0 || y < 0 || x >= self.width as isize || y >= self.height as isize {
                    continue;
                }
                let other = self.truth.depth[y as usize * self.width + x as usize];
                if other <= 0.0 {
                    found.push(None);
                } else if (other - z).abs() > EDGE_M {
                    found.push(Some(other));
                }
            }
        }
        (!found.is_empty()).then(|| found[(pick % found.len() as u64) as usize])
    }

    /// Time of flight: a pixel on an edge mixes both depths.
    fn time_of_flight(&self, i: usize, noise: NoiseSeed) -> Option<f64> {
        const RANGE: std::ops::Range<f64> = 0.5..4.5;
        let (z, cosine) = (f64::from(self.truth.depth[i]), f64::from(self.truth.cosine[i]));
        let albedo = f64::from(self.truth.albedo[i]);
        let chance = noise.uniform(i, 1);
        let mut mixed = z;
        if let Some(beyond) = self.beyond_edge(i, bits_at(noise.seed ^ 2, noise.frame, i as u64)) {
            match beyond {
                Some(other) if chance < 0.35 => mixed = z + (f64::from(other) - z) * noise.uniform(i, 3),
                None if chance < 0.3 => return None,
                _ => {}
            }
        }
        let grazing = cosine < 0.15 && noise.uniform(i, 4) > cosine / 0.15;
        let dark = noise.uniform(i, 5) < 0.002 + 0.2 * (1.0 - albedo / 0.02).max(0.0);
        if grazing || dark || !RANGE.contains(&mixed) {
            return None;
        }
        let slope = ((1.0 - cosine * cosine).max(0.0) / (cosine * cosine).max(0.02)).min(16.0);
        let spread =
            0.0015 * (0.6 + 0.1 * z * z) * (1.0 + 0.08 * slope) * (0.25 / albedo.clamp(0.03, 0.5)).sqrt().max(0.9);
        Some(mixed + spread * noise.normal(i, 6))
    }

    /// Structured light: a disparity with noise, rounded to 1/8 pixel.
    fn structured_light(&self, i: usize, focal_baseline: f64, noise: NoiseSeed) -> Option<f64> {
        const STEP: f64 = 0.125;
        const RANGE: std::ops::Range<f64> = 0.5..6.0;
        let (u, v) = self.at(i);
        let (z, cosine) = (f64::from(self.truth.depth[i]), f64::from(self.truth.cosine[i]));
        if cosine < 0.25 && noise.uniform(i, 4) > cosine / 0.25 {
            return None;
        }
        if self.beyond_edge(i, 0).is_some() && noise.uniform(i, 1) < 0.4 {
            return None;
        }
        let disparity = focal_baseline / z + 0.04 * noise.normal(i, 6) + 0.05 * noise.lumpy(u, v, 5.0, 7);
        let z = focal_baseline / ((disparity / STEP).round() * STEP).max(STEP);
        RANGE.contains(&z).then_some(z)
    }

    /// Stereo matching: lumpy disparity noise, nothing on edges.
    fn stereo(&self, i: usize, focal_baseline: f64, noise: NoiseSeed) -> Option<f64> {
        const RANGE: std::ops::Range<f64> = 0.45..8.0;
        let (u, v) = self.at(i);
        let (z, cosine) = (f64::from(self.truth.depth[i]), f64::from(self.truth.cosine[i]));
        let on_edge = self.beyond_edge(i, 0).is_some() && noise.uniform(i, 1) < 0.7;
        let unmatched = noise.lumpy(u, v, 9.0, 8) > 2.6 + cosine;
        if on_edge || unmatched || (cosine < 0.2 && noise.uniform(i, 4) > cosine / 0.2) {
            return None;
        }
        let disparity = focal_baseline / z + 0.015 * noise.normal(i, 6) + 0.045 * noise.lumpy(u, v, 7.0, 7);
        let z = focal_baseline / disparity.max(0.1);
        RANGE.contains(&z).then_some(z)
    }

    /// Pixels that the second eye (or the projector), a baseline along +X, does not see: something to their right
    /// lands left of them there.
    fn hidden_from_second_eye(&self, focal_baseline: f64) -> Vec<bool> {
        let mut hidden = vec![false; self.truth.depth.len()];
        hidden.par_chunks_mut(self.width).enumerate().for_each(|(row, out)| {
            let depth = &self.truth.depth[row * self.width..][..self.width];
            let mut leftmost = f64::INFINITY;
            for (u, &z) in depth.iter().enumerate().rev().filter(|(_, z)| **z > 0.0) {
                let seen_at = u as f64 - focal_baseline / f64::from(z);
                out[u] = seen_at > leftmost;
                leftmost = leftmost.min(seen_at);
            }
        });
        hidden
    }
}
