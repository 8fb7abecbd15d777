//! The pictures that each vertex takes its detail from.
//!
//! One energy decides: how short and near a piece of surface is seen (sharpness follows from both), how far it is from something that
//! hides it, and how far its light is from what all pictures agree on. A picture's weight is the exponential of its negative energy, less
//! that of the best picture that is not used, so that a picture comes and goes without a border.

use rayon::prelude::*;

use crate::{level::Levels, sight::Sight};

/// How much better a picture must see a place to count more: a weight is this power of the quality. At 5, a picture that looks 30 degrees
/// aside counts half; the error of a depth of 1 mm then shifts its detail by half of one, a quarter of a usual pixel.
const SHARPNESS: f32 = 5.0;
/// Difference in light, in logarithms, at which a picture counts half.
const HIGHLIGHT: f32 = 0.15;

/// Pictures and weights of each vertex: weights sum to 1, or there is none.
pub(crate) fn choose(sights: &[Sight], levels: &Levels, most: usize) -> Vec<Vec<(u16, f32)>> {
    let of_vertex = |v: usize| {
        let best = sights.iter().map(|s| s.quality[v]).fold(0.0f32, f32::max);
        if best <= 0.0 {
            return Vec::new();
        }
        let weigh = |(f, sight): (usize, &Sight)| {
            let quality = sight.quality[v];
            let light = 1.0 + (levels.off[f][v] / HIGHLIGHT).powi(2);
            (quality > 0.0).then(|| (f as u16, (quality / best).powf(SHARPNESS) / light))
        };
        let mut all: Vec<(u16, f32)> = sights.iter().enumerate().filter_map(weigh).collect();
        all.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let unused = all.get(most).map_or(0.0, |next| next.1);
        all.truncate(most);
        all.iter_mut().for_each(|w| w.1 -= unused);
        let sum: f32 = all.iter().map(|w| w.1).sum();
        if sum <= 0.0 {
            all.truncate(1);
            return vec![(all[0].0, 1.0)];
        }
        all.retain(|w| w.1 > 0.0);
        all.iter_mut().for_each(|w| w.1 /= sum);
        all
    };
    (0..levels.colors.len()).into_par_iter().map(of_vertex).collect()
}
