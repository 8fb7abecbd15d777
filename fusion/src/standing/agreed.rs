//! The depth that the frames of a resting camera agree on while nothing moves.

use crate::{frame::is_measured, subject::Resting};

/// A pixel counts where at least this share of the frames measured it.
const MEASURED: f32 = 0.5;
/// Depths farther than this share from their median are outliers: flying pixels.
const OUTLYING: f32 = 0.012;

/// Mean depth of each pixel over frames (metres, 0 missing) without its outliers, and a single frame's standard deviation
/// about it.
pub(crate) fn agreed(depths: &[Vec<f32>]) -> Resting {
    let mut seen = Resting::default();
    let mut values = Vec::with_capacity(depths.len());
    for i in 0..depths.first().map_or(0, Vec::len) {
        values.clear();
        values.extend(depths.iter().map(|d| d[i]).filter(|d| is_measured(*d)));
        values.sort_unstable_by(f32::total_cmp);
        let is_seen = values.len() as f32 >= MEASURED * depths.len() as f32 && !values.is_empty();
        let (depth, noise) = if is_seen { mean_and_deviation(&values) } else { (0.0, 0.0) };
        seen.depth.push(depth);
        seen.noise.push(noise);
    }
    seen
}

fn mean_and_deviation(ascending: &[f32]) -> (f32, f32) {
    let median = ascending[ascending.len() / 2];
    let near = || ascending.iter().filter(|d| (**d - median).abs() <= OUTLYING * median);
    let count = near().count() as f32;
    let mean = near().sum::<f32>() / count;
    let squares: f32 = near().map(|d| (d - mean) * (d - mean)).sum();
    (mean, (squares / (count - 1.0).max(1.0)).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flying_pixels_and_rare_ones_do_not_count() {
        let depths = [vec![2.0, 0.0, 1.0], vec![2.01, 0.0, 0.0], vec![1.5, 0.0, 0.0], vec![2.02, 3.0, 1.0]];
        let seen = agreed(&depths);
        assert!((seen.depth[0] - 2.01).abs() < 1e-6 && (seen.noise[0] - 0.01).abs() < 1e-4, "{seen:?}");
        assert_eq!((seen.depth[1], seen.depth[2]), (0.0, 1.0));
    }
}
