//! What a motion's layers did, frame by frame.

use nalgebra::Point3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use toile_animation::blend::{Blend, Outfit};
use toile_character::Motion;
use toile_geometry::statistics::{Rank, quantile_by};

use super::options::{AnimateOptions, Profile};
use crate::garment::Garment;

/// `report.json` of a motion.
#[derive(Debug, Clone, Serialize)]
pub struct AnimationReport {
    /// Name of the motion.
    pub motion: String,
    /// Frames a second.
    pub fps: f64,
    /// How much time a frame might take.
    pub profile: Profile,
    /// How the layers followed the skeleton in the profile `bake`.
    pub blend: Blend,
    /// How skin weights were blended.
    pub skinning: &'static str,
    /// For the blend `seed`, the weight w_p of the physics in each garment: one, or two for a skirt (what lies on the body, what hangs).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub physical_shares: Option<Vec<Vec<f64>>>,
    /// Garments, inside to outside.
    pub garments: Vec<String>,
    /// For a motion that goes round: what was played before it, and how well it closes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub endless: Option<Endless>,
    /// Milliseconds a frame: median, and nineteen of twenty are below.
    pub ms_a_frame: [f64; 2],
    /// Pairs of triangles of different layers that cross, mean over the frames.
    pub crossing_mean: f64,
    /// Where the blends were compared: each of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub variants: Option<Vec<Variant>>,
    /// The frames.
    pub frames: Vec<FrameReport>,
}

/// One frame.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct FrameReport {
    /// Milliseconds.
    pub ms: f64,
    /// Pairs of triangles of different layers that cross.
    pub crossing: usize,
    /// True where the motion jumped to here from somewhere else, and cloth was carried along.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub jumped: bool,
    /// Stretch of each layer's edges against the scan that 99 of 100 stay below.
    pub stretch_p99: Vec<f32>,
}

/// How well a motion that goes round closes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Endless {
    /// Seconds of it that were played before the first frame.
    pub seconds_before: f64,
    /// Mean and largest distance of the garments' vertices between the last frame and the first, millimetres.
    pub gap_mm: [f64; 2],
}

/// What one blend does in a motion.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Variant {
    /// The blend.
    pub blend: Blend,
    /// Milliseconds a frame: median, and nineteen of twenty are below.
    pub ms_a_frame: [f64; 2],
    /// Pairs of triangles of different layers that cross, mean over the frames.
    pub crossing_mean: f64,
}

impl FrameReport {
    /// Of the `layers` as they lie now.
    pub fn of(outfit: &Outfit, layers: &[Vec<Point3<f32>>], crossing: usize, ms: f64) -> Self {
        let stretch = |(k, now): (usize, &Vec<Point3<f32>>)| {
            let rest = outfit.scanned(k);
            let edge = |t: &[u32; 3]| {
                let [a, b] = [t[0] as usize, t[1] as usize];
                (now[a] - now[b]).norm() / (rest[a] - rest[b]).norm().max(2e-4)
            };
            let mut all: Vec<f32> = outfit.layers()[k].mesh.triangles.iter().map(edge).collect();
            let place = (all.len() * 99 / 100).min(all.len().saturating_sub(1));
            if all.is_empty() { 1.0 } else { *all.select_nth_unstable_by(place, f32::total_cmp).1 }
        };
        Self { ms, crossing, jumped: false, stretch_p99: layers.par_iter().enumerate().map(stretch).collect() }
    }
}

impl AnimationReport {
    pub(super) fn new(motion: &Motion, options: &AnimateOptions, garments: &[Garment]) -> Self {
        Self {
            motion: motion.name.clone(),
            fps: 1.0 / motion.frame_time,
            profile: options.profile,
            blend: options.blend,
            skinning: options.skinning.name(),
            physical_shares: None,
            garments: garments.iter().map(|g| g.name.clone()).collect(),
            endless: None,
            ms_a_frame: [0.0; 2],
            crossing_mean: 0.0,
            variants: None,
            frames: Vec::with_capacity(motion.poses.len()),
        }
    }

    /// The frame in which the layers stretch most; the first of equals.
    pub(super) fn most_stretched(&self) -> usize {
        let of = |f: &FrameReport| f.stretch_p99.iter().copied().fold(0.0, f32::max);
        let first_of_equals = |a: &(usize, f32), b: &(usize, f32)| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0));
        self.frames.iter().map(of).enumerate().max_by(first_of_equals).map_or(0, |(frame, _)| frame)
    }

    pub(super) fn sum_up(&mut self) {
        let mut times: Vec<f64> = self.frames.iter().map(|f| f.ms).collect();
        self.ms_a_frame = [0.5, 0.95].map(|q| quantile_by(&mut times, q, Rank::Count).unwrap_or(0.0));
        let crossing: usize = self.frames.iter().map(|f| f.crossing).sum();
        self.crossing_mean = crossing as f64 / self.frames.len().max(1) as f64;
    }

    /// Sentences for the operator.
    pub(super) fn warnings(&self) -> Vec<String> {
        let mut out = self.crossings();
        let jumps: Vec<String> =
            (0..self.frames.len()).filter(|&f| self.frames[f].jumped).map(|f| f.to_string()).collect();
        if let Some(first) = jumps.first() {
            let more = if jumps.len() > 1 { format!(" and {} more", jumps.len() - 1) } else { String::new() };
            out.push(format!(
                "motion {}: it jumps to another place at frame {first}{more}, faster than anybody runs; cloth was carried along",
                self.motion
            ));
        }
        out
    }

    fn crossings(&self) -> Vec<String> {
        let crossing = self.frames.iter().filter(|f| f.crossing > 0).count();
        if crossing == 0 || self.blend != Blend::Anchored {
            return Vec::new();
        }
        let (frames, mean) = (self.frames.len(), self.crossing_mean);
        vec![format!("layers cross in {crossing} of {frames} frames, {mean:.1} pairs of triangles a frame on average")]
    }
}
