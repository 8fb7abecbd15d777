//! The background, which rests behind the subject: the camera does not move, so that each pixel sees the same in many frames.

use crate::frame::is_measured;

/// Share of the frames that must agree on a pixel's background for it to rest.
const RESTING: f32 = 0.4;
/// A pixel measured in at most this share of the frames sees nothing but what passes.
const PASSING: f32 = 0.25;
/// Rounds in which a pixel's window of resting depths is centred.
const CENTERING: usize = 3;

/// The resting surface of each pixel over the frames of a survey.
#[derive(Debug, Clone, Default)]
pub(crate) struct Resting {
    /// Median depth, metres; 0 where nothing rests.
    pub depth: Vec<f32>,
    /// Standard deviation of a single frame's depth, metres; 0 where nothing rests.
    pub noise: Vec<f32>,
}

/// The background, which rests behind the subject.
pub(crate) struct Background {
    /// The farthest depth of each pixel that a second frame confirms; 0 where there is none.
    pub far: Vec<f32>,
    /// Where many frames agree on that depth: what it is.
    pub resting: Resting,
    /// True where few frames measure anything: what is seen there passes by.
    pub open: Vec<bool>,
}

impl Background {
    pub(crate) fn new(depths: &[Vec<f32>]) -> Self {
        let count = depths.first().map_or(0, Vec::len);
        let (mut far, mut resting, mut open) = (Vec::new(), Resting::default(), Vec::new());
        let mut values = Vec::with_capacity(depths.len());
        for i in 0..count {
            values.clear();
            values.extend(depths.iter().map(|d| d[i]).filter(|&d| is_measured(d)));
            values.sort_unstable_by(f32::total_cmp);
            let confirmed = values.windows(2).rev().find(|w| w[1] - w[0] < 0.02 * w[1]).map_or(0.0, |w| w[0]);
            let near = confirmed - 0.015f32.max(0.012 * confirmed);
            let agreeing = &values[values.partition_point(|&d| d < near)..];
            let rests = agreeing.len() as f32 >= RESTING * depths.len() as f32;
            let (depth, noise) = if rests { median_and_deviation(&values, agreeing) } else { (0.0, 0.0) };
            resting.depth.push(depth);
            resting.noise.push(noise);
            far.push(confirmed);
            open.push(values.len() as f32 <= PASSING * depths.len() as f32);
        }
        Self { far, resting, open }
    }
}

/// Median of the depths of a resting surface and their standard deviation about it, from all of a pixel's depths
/// (ascending) and the farthest ones that agree. The farthest depths alone lie behind the surface by twice the noise, so
/// the window is moved until it reaches as far before the median as behind it.
fn median_and_deviation(ascending: &[f32], farthest: &[f32]) -> (f32, f32) {
    let mut window = farthest;
    for _ in 0..CENTERING {
        let (median, last) = (window[window.len() / 2], window[window.len() - 1]);
        let end = ascending.partition_point(|&d| d <= last);
        window = &ascending[ascending.partition_point(|&d| d < 2.0 * median - last)..end];
    }
    let median = window[window.len() / 2];
    let squares: f32 = window.iter().map(|d| (d - median) * (d - median)).sum();
    (median, (squares / window.len() as f32).sqrt())
}
