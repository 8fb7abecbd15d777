//! Semi-global matching of a rectified pair (Hirschmüller 2008) on census costs.

use rayon::prelude::*;
use toile_geometry::lanes::bytes::{Kernel, LANES, Lanes, dispatch};

use crate::{GrayImage, MatchSettings, StereoError, census, median::median, row::RowMatcher, speckle::remove_speckles};

/// Rows of a strip. Strips are matched apart, so that threads can share them; their size is fixed, so that the result
/// does not depend on the threads.
const STRIP_ROWS: usize = 96;

/// Rows above a strip that are matched first, so that its paths from above have settled. Measured on real pairs: without
/// any, 0.1 to 0.2 % of the pixels lose their answer; beyond 8 nothing changes.
const LEAD_ROWS: usize = 8;

/// Disparities of the left image, row by row: a pixel at column `u` is seen at column `u - disparity` on the right.
#[derive(Debug, Clone, PartialEq)]
pub struct DisparityMap {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Pixels, with fractions; 0 where there is no answer.
    pub values: Vec<f32>,
}

/// Disparities of the left one of two rectified images.
///
/// Five paths a pixel (left, right and the three from above), all in one pass over the rows: memory is a few rows.
/// A pixel has an answer where its winner is unique, the right image agrees, both neighbours of the winner were searched
/// (so nothing at infinity), and it does not belong to a small island.
///
/// # Errors
/// [`StereoError::Images`] where the images differ in size, [`StereoError::Settings`] where a setting is out of range.
pub fn match_pair(left: &GrayImage, right: &GrayImage, settings: &MatchSettings) -> Result<DisparityMap, StereoError> {
    match_with(left, right, settings, STRIP_ROWS)
}

pub(crate) fn match_with(
    left: &GrayImage,
    right: &GrayImage,
    settings: &MatchSettings,
    strip_rows: usize,
) -> Result<DisparityMap, StereoError> {
    if (left.width, left.height) != (right.width, right.height) || !left.is_valid() || !right.is_valid() {
        let size = |i: &GrayImage| (i.width, i.height, i.pixels.len());
        return Err(StereoError::Images { left: size(left), right: size(right) });
    }
    settings.check(left.width)?;
    let (w, h) = (left.width as usize, left.height as usize);
    let mut values = vec![0.0; w * h];
    values.par_chunks_mut(w * strip_rows).enumerate().for_each(|(i, out)| {
        let first = i * strip_rows;
        match_strip(Strip { left, right, settings, first, lead: LEAD_ROWS.min(first), out });
    });
    if settings.median {
        values = median(&values, w);
    }
    remove_speckles(&mut values, w, settings.speckle_area as usize, settings.speckle_step);
    Ok(DisparityMap { width: left.width, height: left.height, values })
}

/// Rows from `first` on, as many as `out` has, after `lead` rows that only prepare them.
struct Strip<'a> {
    left: &'a GrayImage,
    right: &'a GrayImage,
    settings: &'a MatchSettings,
    first: usize,
    lead: usize,
    out: &'a mut [f32],
}

/// Chooses the code compiled for the number of disparities, and for this processor.
fn match_strip(strip: Strip<'_>) {
    match (strip.settings.disparities as usize).div_ceil(LANES) {
        0..=1 => dispatch(MatchRows::<1>(strip)),
        2 => dispatch(MatchRows::<2>(strip)),
        3 => dispatch(MatchRows::<3>(strip)),
        4 => dispatch(MatchRows::<4>(strip)),
        5..=6 => dispatch(MatchRows::<6>(strip)),
        _ => dispatch(MatchRows::<8>(strip)),
    }
}

/// Matches the rows of a strip with `N` vectors of disparities a pixel.
struct MatchRows<'a, const N: usize>(Strip<'a>);

impl<const N: usize> Kernel for MatchRows<'_, N> {
    type Output = ();

    /// One row after the other. Everything below is inlined into one function, so that all of it is compiled for the
    /// processor it was chosen for.
    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let Strip { left, right, settings, first, lead, out } = self.0;
        let w = left.width as usize;
        let rows = first - lead..first + out.len() / w;
        let margin = settings.min_disparity as usize + N * LANES;
        let left = census::transform(left, rows.clone(), false, 0);
        let right = census::transform(right, rows.clone(), true, margin);
        let mut matcher = RowMatcher::<N>::new(w, settings);
        for v in 0..rows.len() {
            matcher.match_row(lanes, &left, &right, v);
            matcher.aggregate_row(lanes);
            matcher.select_row(lanes);
            if v >= lead {
                matcher.answer(&mut out[(v - lead) * w..][..w]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use toile_geometry::lanes::bytes::Portable;

    use super::*;
    use crate::testing::{brute_force, noise, shifted};

    /// Settings of one search with nothing done afterwards.
    fn bare(min_disparity: u32, disparities: u32) -> MatchSettings {
        MatchSettings { min_disparity, disparities, speckle_area: 0, median: false, ..MatchSettings::default() }
    }

    #[test]
    fn agrees_with_the_textbook() {
        for (min, count, seed) in [(0, 32, 1), (3, 64, 2), (0, 96, 3), (20, 32, 4)] {
            let left = noise(70, 21, seed);
            let right = shifted(&left, 9 + min, seed);
            let settings = bare(min, count);
            let found = match_pair(&left, &right, &settings).unwrap();
            assert_eq!(found.values, brute_force(&left, &right, &settings), "{min} {count}");
            assert!(found.values.iter().filter(|&&d| d > 0.0).count() > 300, "too few answers to judge by");
        }
    }

    /// The rows of one strip by the best lanes of this machine and by plain Rust.
    fn both_ways<const N: usize>(disparities: u32) {
        let left = noise(150, 30, u64::from(disparities));
        let right = shifted(&left, 13, 5);
        let settings = &MatchSettings { disparities, ..MatchSettings::default() };
        let with = |run: fn(MatchRows<'_, N>)| {
            let mut out = vec![0.0; 150 * 22];
            run(MatchRows(Strip { left: &left, right: &right, settings, first: 8, lead: 8, out: &mut out }));
            out
        };
        let best = with(|rows| dispatch(rows));
        assert_eq!(best, with(|rows| rows.run(Portable)), "{disparities}");
        assert!(best.iter().filter(|d| **d > 0.0).count() > 1000);
    }

    #[test]
    fn every_machine_gives_the_same_bits() {
        both_ways::<1>(32);
        both_ways::<2>(64);
        both_ways::<3>(96);
        both_ways::<4>(128);
        both_ways::<6>(192);
        both_ways::<8>(256);
    }

    #[test]
    fn threads_do_not_change_the_result_and_strips_leave_no_seam() {
        let left = noise(160, 3 * STRIP_ROWS as u32 + 11, 8);
        let right = shifted(&left, 17, 9);
        let settings = bare(0, 64);
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| match_pair(&left, &right, &settings).unwrap())
        };
        let (one, four) = (with(1), with(4));
        assert_eq!(one, four);
        let whole = match_with(&left, &right, &settings, 10_000).unwrap();
        let other = one.values.iter().zip(&whole.values).filter(|(a, b)| (*a - *b).abs() > 0.25).count();
        assert!(other * 500 < whole.values.len(), "{other} pixels differ from matching without strips");
    }

    #[test]
    fn a_shifted_image_has_one_disparity_and_gain_does_not_matter() {
        let left = noise(200, 60, 3);
        let mut right = shifted(&left, 25, 4);
        right.pixels.iter_mut().for_each(|p| *p = *p / 2 + 60);
        let map = match_pair(&left, &right, &MatchSettings::default()).unwrap();
        let seen = (0..60usize).flat_map(|v| (40..190).map(move |u| (u, v)));
        // Noise has no slopes for fractions to follow: half a pixel is what the winner alone promises.
        let wrong = seen.filter(|&(u, v)| (map.values[v * 200 + u] - 25.0).abs() > 0.5).count();
        assert!(wrong < 30, "{wrong} of 9000");
    }

    #[test]
    fn pictures_without_texture_and_tiny_ones_have_no_answer_and_wrong_ones_are_refused() {
        let flat = GrayImage { width: 100, height: 50, pixels: vec![90; 5000] };
        let map = match_pair(&flat, &flat, &MatchSettings::default()).unwrap();
        assert!(map.values.iter().all(|&d| d == 0.0));
        let dot = GrayImage { width: 1, height: 1, pixels: vec![3] };
        assert_eq!(match_pair(&dot, &dot, &MatchSettings::default()).unwrap().values, [0.0]);
        assert!(matches!(match_pair(&flat, &dot, &MatchSettings::default()), Err(StereoError::Images { .. })));
        let torn = GrayImage { width: 100, height: 50, pixels: vec![90; 4999] };
        assert!(matches!(match_pair(&torn, &torn, &MatchSettings::default()), Err(StereoError::Images { .. })));
    }
}
