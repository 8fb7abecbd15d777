//! How nuisances spoil a frame: what light does before the sensor measures, and what measuring does to it.

use nalgebra::Point3;
use toile_geometry::{Rigid, camera::PinholeCamera};

use crate::{
    nuisances::Nuisances,
    room::DISK_RADIUS,
    sensor::{DEPTH_SCALE, NoiseSeed, TrueImage},
};

/// Cloth that reflects less than this is black.
const BLACK: f32 = 0.01;
/// What usual cloth reflects.
const USUAL: f32 = 0.3;
/// How many times as noisy black cloth is, and the share of it that is not measured.
const DARK_NOISE: f64 = 4.0;
const DARK_LOST: f64 = 0.15;
/// Light by way of the floor falls to a third over this height, metres.
const MULTIPATH_HEIGHT: f64 = 0.08;
/// Blotches are as wide as this, pixels.
const BLOTCH_PIXELS: f64 = 9.0;
/// The disk seems to rise within this many pixels of what stands on it.
const PLATE_PIXELS: usize = 6;
/// The lowest part of a subject that counts as standing over the disk, metres.
const STANDING: f64 = 0.015;
/// A subject's hair is this share of its height from the top.
const HAIR: f64 = 0.1;
/// Depth from one flying pixel of a brim to the next, metres, and its spread.
const BRIM_STEP: (f64, f64) = (0.02, 0.012);
/// Threads are seen below this height, metres, and in this share of the rows of a frame.
const STRINGS_BELOW: f64 = 0.5;
const STRINGS_SEEN: f64 = 0.5;

/// Where the pixels of a picture are.
pub(crate) struct Stage<'a> {
    pub camera: &'a PinholeCamera,
    pub room_from_camera: &'a Rigid,
    /// Height of the subject's highest point over the disk, metres.
    pub top: f64,
    pub noise: NoiseSeed,
}

impl Stage<'_> {
    fn width(&self) -> usize {
        self.camera.width as usize
    }

    /// The point at a depth of a pixel, in the room.
    fn point(&self, i: usize, depth: f64) -> Point3<f64> {
        let (u, v) = ((i % self.width()) as f64, (i / self.width()) as f64);
        self.room_from_camera * self.camera.unproject(u, v, depth)
    }

    /// The height of a pixel of the subject or disk over the disk; `None` beside both.
    fn height(&self, truth: &TrueImage, i: usize) -> Option<f64> {
        let z = f64::from(truth.depth[i]);
        let p = self.point(i, z);
        (z > 0.0 && p.y > -0.01 && p.x.hypot(p.z) < f64::from(1.3 * DISK_RADIUS)).then_some(p.y)
    }

    /// Heights of the pixels that show the subject.
    fn standing(&self, truth: &TrueImage) -> Vec<Option<f64>> {
        (0..truth.depth.len()).map(|i| self.height(truth, i).filter(|y| *y > STANDING)).collect()
    }

    /// The nearest pixel within `reach` for which something holds, and how far it is, pixels.
    fn nearest(&self, i: usize, reach: usize, holds: impl Fn(usize) -> bool) -> Option<(usize, f64)> {
        let (width, reach) = (self.width(), reach as isize);
        let (u, v) = ((i % width) as isize, (i / width) as isize);
        let around = (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| (dx, dy)));
        let within = around.filter_map(|(dx, dy)| {
            let (x, y) = (u + dx, v + dy);
            let is_inside = x >= 0 && y >= 0 && x < width as isize && y < self.camera.height as isize;
            let far = (dx as f64).hypot(dy as f64);
            let j = if is_inside { y as usize * width + x as usize } else { return None };
            (far <= reach as f64 && holds(j)).then_some((j, far))
        });
        within.min_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// Spoils what the sensor sees: light by way of the floor, plates, threads and brims.
pub(crate) fn spoil_light(nuisances: &Nuisances, stage: &Stage<'_>, truth: &mut TrueImage) {
    let standing = stage.standing(truth);
    if nuisances.multipath_m > 0.0 {
        add_multipath(nuisances.multipath_m, stage, truth);
    }
    if nuisances.plates_m > 0.0 {
        add_plates(nuisances.plates_m, stage, truth, &standing);
    }
    if nuisances.strings_pixels > 0 {
        add_strings(nuisances.strings_pixels, stage, truth, &standing);
    }
    if nuisances.brim_pixels > 0 {
        add_brim(nuisances.brim_pixels, stage, truth, &standing);
    }
}

fn add_multipath(farther: f64, stage: &Stage<'_>, truth: &mut TrueImage) {
    for i in 0..truth.depth.len() {
        if let Some(y) = stage.height(truth, i) {
            truth.depth[i] += (farther * (-y.max(0.0) / MULTIPATH_HEIGHT).exp()) as f32;
        }
    }
}

/// The disk rises towards the rim of what stands on it.
fn add_plates(rise: f64, stage: &Stage<'_>, truth: &mut TrueImage, standing: &[Option<f64>]) {
    let eye = stage.room_from_camera.translation.vector.y;
    for i in 0..truth.depth.len() {
        let Some(y) = stage.height(truth, i).filter(|y| *y <= STANDING) else { continue };
        let low = |j: usize| standing[j].is_some_and(|y| y < 0.12);
        if let Some((_, far)) = stage.nearest(i, PLATE_PIXELS, low) {
            let risen = y + rise * (1.0 - far / (PLATE_PIXELS + 1) as f64);
            truth.depth[i] *= ((eye - risen) / (eye - y)) as f32;
        }
    }
}

/// Threads from the last pixel of one leg to the first of the other.
fn add_strings(widest: usize, stage: &Stage<'_>, truth: &mut TrueImage, standing: &[Option<f64>]) {
    let width = stage.width();
    let is_leg = |i: usize| standing[i].is_some_and(|y| y < STRINGS_BELOW);
    for row in 0..stage.camera.height as usize {
        if stage.noise.uniform(row, 31) > STRINGS_SEEN {
            continue;
        }
        let legs: Vec<usize> = (row * width..(row + 1) * width).filter(|&i| is_leg(i)).collect();
        for ends in legs.windows(2).filter(|w| (2..=widest).contains(&(w[1] - w[0]))) {
            let (from, to) = (truth.depth[ends[0]], truth.depth[ends[1]]);
            for i in ends[0] + 1..ends[1] {
                let share = (i - ends[0]) as f32 / (ends[1] - ends[0]) as f32;
                truth.depth[i] = from + (to - from) * share;
                truth.cosine[i] = 0.5;
            }
        }
    }
}

/// Flying pixels behind the rim of the hair, the farther out the deeper.
fn add_brim(widest: usize, stage: &Stage<'_>, truth: &mut TrueImage, standing: &[Option<f64>]) {
    let rim = truth.depth.clone();
    for i in (0..rim.len()).filter(|&i| standing[i].is_none()) {
        let is_hair = |j: usize| standing[j].is_some_and(|y| y > (1.0 - HAIR) * stage.top);
        let Some((j, far)) = stage.nearest(i, widest, is_hair) else { continue };
        let (step, spread) = BRIM_STEP;
        if stage.noise.uniform(i, 32) < 0.6 {
            let behind = (far * step + spread * stage.noise.normal(i, 33)).max(0.0);
            truth.depth[i] = rim[j] + behind as f32;
            truth.cosine[i] = 0.3;
            truth.albedo[i] = truth.albedo[j];
        }
    }
}

/// Which pixels show black cloth. To the sensor it is then as bright as other cloth: how much noisier black is, is said
/// here and not by the sensor's own law of darkness.
pub(crate) fn whiten_dark_cloth(truth: &mut TrueImage) -> Vec<bool> {
    let dark: Vec<bool> = truth.albedo.iter().map(|a| *a < BLACK).collect();
    truth.albedo.iter_mut().filter(|a| **a < BLACK).for_each(|a| *a = USUAL);
    dark
}

/// Spoils what the sensor has measured (units of [`DEPTH_SCALE`]): dark cloth, blotches, and the scale.
pub(crate) fn spoil_depth(
    nuisances: &Nuisances,
    noise: NoiseSeed,
    width: usize,
    (truth, dark): (&TrueImage, &[bool]),
    values: &mut [u16],
) {
    for (i, value) in values.iter_mut().enumerate().filter(|(_, v)| **v != 0) {
        let (exact, mut depth) = (f64::from(truth.depth[i]), f64::from(*value) * DEPTH_SCALE);
        if dark.get(i).copied().unwrap_or(false) {
            let is_lost = noise.uniform(i, 34) < DARK_LOST;
            depth = if is_lost { 0.0 } else { exact + DARK_NOISE * (depth - exact) };
        }
        if depth > 0.0 && nuisances.blotches_m > 0.0 {
            let spread = nuisances.blotches_m * (exact / 2.0).powi(2);
            depth += spread * noise.lumpy(i % width, i / width, BLOTCH_PIXELS, 35);
        }
        *value = (depth * nuisances.depth_scale / DEPTH_SCALE).round().clamp(0.0, 65_535.0) as u16;
    }
}
