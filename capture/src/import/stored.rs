//! Pictures of one sensor that lie in one file (or few) beside each other: frames by time, read when they are asked for.

use std::{fmt, path::PathBuf, sync::Arc};

use crate::{CaptureError, ColorImage, DepthImage, Frame, Rig, Source, associate::associate};

/// Depth and colour further apart than this do not belong together: two thirds of a frame at 30 a second.
const MAX_APART_NS: i64 = 20_000_000;

/// Whatever the pictures are read from.
pub(super) trait Album: Send + fmt::Debug {
    /// Depth picture `k`, in the order of the list that the frames were made of.
    ///
    /// # Errors
    /// What is wrong with it.
    fn depth(&mut self, k: usize) -> Result<DepthImage, String>;

    /// Colour picture `k`.
    ///
    /// # Errors
    /// What is wrong with it.
    fn color(&mut self, k: usize) -> Result<ColorImage, String>;
}

/// A frame by the places of its pictures in their lists.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Shot {
    pub(super) number: u64,
    pub(super) time_ns: i64,
    pub(super) depth: Option<usize>,
    pub(super) color: Option<usize>,
}

/// Frames of depth and colour pictures with times: each depth picture with the colour nearest in time, at most half a frame or
/// 20 ms away, each used once. Frames are in the order of their times and numbered by it.
pub(super) fn shots(depth_ns: &[i64], color_ns: &[i64]) -> Vec<Shot> {
    let sorted = |times: &[i64]| {
        let mut order: Vec<usize> = (0..times.len()).collect();
        order.sort_by_key(|&k| times[k]);
        order
    };
    let (depth, color) = (sorted(depth_ns), sorted(color_ns));
    let at = |order: &[usize], times: &[i64]| order.iter().map(|&k| times[k]).collect::<Vec<i64>>();
    let (depth_times, color_times) = (at(&depth, depth_ns), at(&color, color_ns));
    let apart = median_step(&depth_times).map_or(MAX_APART_NS, |step| MAX_APART_NS.max(step / 2));
    let partner = associate(&depth_times, &color_times, apart);
    let mut is_alone = vec![true; color.len()];
    partner.iter().flatten().for_each(|&j| is_alone[j] = false);
    let paired = depth.iter().zip(&partner).map(|(&k, j)| (depth_ns[k], Some(k), j.map(|j| color[j])));
    let alone = color.iter().zip(&is_alone).filter(|(_, alone)| **alone).map(|(&k, _)| (color_ns[k], None, Some(k)));
    let mut all: Vec<_> = paired.chain(alone).collect();
    all.sort_by_key(|shot| shot.0);
    let shot = |(number, (time_ns, depth, color))| Shot { number: number as u64, time_ns, depth, color };
    all.into_iter().enumerate().map(shot).collect()
}

/// Frames with numbers that count the missing ones, too, and how many are missing before each.
pub(super) fn numbered(mut shots: Vec<Shot>, period_ns: i64) -> (Vec<Shot>, Vec<u32>) {
    let (mut number, mut before, mut missing) = (0, None, Vec::new());
    for shot in &mut shots {
        let steps = match before {
            Some(before) if period_ns > 0 => {
                let steps = shot.time_ns.saturating_sub(before) as f64 / period_ns as f64;
                steps.round().clamp(1.0, f64::from(u32::MAX)) as u32
            }
            Some(_) => 1,
            None => 0,
        };
        number += u64::from(steps);
        missing.push(steps.saturating_sub(1));
        (shot.number, before) = (number, Some(shot.time_ns));
    }
    (shots, missing)
}

/// The median step of times in their order; `None` where they do not rise.
fn median_step(times: &[i64]) -> Option<i64> {
    let mut steps: Vec<i64> = times.windows(2).map(|pair| pair[1].saturating_sub(pair[0])).collect();
    steps.sort_unstable();
    steps.get(steps.len() / 2).copied().filter(|step| *step > 0)
}

/// Frames a second by the median step of times; 0 where they do not show any.
pub(super) fn fps(shots: &[Shot]) -> f64 {
    let times: Vec<i64> = shots.iter().map(|shot| shot.time_ns).collect();
    median_step(&times).map_or(0.0, |step| 1e9 / step as f64)
}

/// Pictures as a source of frames.
#[derive(Debug)]
pub(super) struct StoredSource {
    path: PathBuf,
    rig: Rig,
    shots: Vec<Shot>,
    album: Box<dyn Album>,
    next: usize,
    remarks: Vec<String>,
    /// How many frames are missing before each; empty where that is not known.
    missing: Vec<u32>,
}

impl StoredSource {
    /// A source over `shots`.
    ///
    /// # Errors
    /// [`CaptureError`] where there is no depth picture.
    pub(super) fn new(
        path: PathBuf,
        rig: Rig,
        shots: Vec<Shot>,
        album: Box<dyn Album>,
        remarks: Vec<String>,
    ) -> Result<Self, CaptureError> {
        if !shots.iter().any(|shot| shot.depth.is_some()) {
            return Err(CaptureError::format(&path, "there is no depth picture in it"));
        }
        Ok(Self { path, rig, shots, album, next: 0, remarks, missing: Vec::new() })
    }

    /// The same with the number of frames that are missing before each.
    pub(super) fn missing(self, missing: Vec<u32>) -> Self {
        Self { missing, ..self }
    }

    fn load(&mut self, index: usize) -> Result<Frame, CaptureError> {
        let shot = self.shots[index];
        let sensor = &self.rig.sensors[0];
        let wrong = |what: &str, reason: String| {
            CaptureError::format(&self.path, format!("frame {}: the {what} {reason}", shot.number))
        };
        let depth = shot.depth.map(|k| self.album.depth(k)).transpose().map_err(|reason| wrong("depth", reason))?;
        if let Some(depth) = depth.as_ref().filter(|d| (d.width, d.height) != (sensor.depth.width, sensor.depth.height))
        {
            let reason = format!(
                "has {} x {} pixels, but its calibration says {} x {}",
                depth.width, depth.height, sensor.depth.width, sensor.depth.height
            );
            return Err(wrong("depth", reason));
        }
        let color = shot.color.filter(|_| sensor.color.is_some());
        let color = color.map(|k| self.album.color(k)).transpose().map_err(|reason| wrong("colour", reason))?;
        Ok(Frame {
            sensor: 0,
            index: index as u64,
            device_frame: shot.number,
            lost_before: self.missing.get(index).copied().unwrap_or(0),
            device_time_ns: shot.time_ns,
            host_time_ns: shot.time_ns,
            depth: depth.map(Arc::new),
            color,
        })
    }
}

impl Source for StoredSource {
    fn rig(&self) -> &Rig {
        &self.rig
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, CaptureError> {
        if self.next >= self.shots.len() {
            return Ok(None);
        }
        self.next += 1;
        self.load(self.next - 1).map(Some)
    }

    fn frame_count(&self) -> Option<u64> {
        Some(self.shots.len() as u64)
    }

    fn remarks(&self) -> Vec<String> {
        self.remarks.clone()
    }
}

/// Depth in metres as whole millimetres; 0 where there is none, or where it lies beyond 65 m.
pub(super) fn millimetres(metres: f32) -> u16 {
    let value = (f64::from(metres) * 1000.0).round();
    if (1.0..=65535.0).contains(&value) { value as u16 } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_pair_within_half_a_frame_whatever_their_order() {
        let ms = |list: &[i64]| list.iter().map(|t| t * 1_000_000).collect::<Vec<i64>>();
        let shots = shots(&ms(&[300, 0, 150]), &ms(&[70, 160, 400, 301]));
        let found: Vec<_> = shots.iter().map(|s| (s.time_ns / 1_000_000, s.depth, s.color)).collect();
        assert_eq!(
            found,
            [(0, Some(1), Some(0)), (150, Some(2), Some(1)), (300, Some(0), Some(3)), (400, None, Some(2))]
        );
        assert!((fps(&shots) - 1000.0 / 150.0).abs() < 1e-9);
        assert_eq!([0.0004, 1.2345, 70.0, f32::NAN, -1.0].map(millimetres), [0, 1235, 0, 0, 0]);
    }
}
