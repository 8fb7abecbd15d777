//! Semi-global matching of a rectified pair (Hirschmüller 2008) on census costs.

use rayon::prelude::*;

use crate::{
    GrayImage, MatchSettings, StereoError, census,
    lanes::{LANES, Lanes, Portable},
    median::median,
    row::RowMatcher,
    speckle::remove_speckles,
};

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
    match_with(left, right, settings, Machine::best(), STRIP_ROWS)
}

/// Which vector operations to use.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Machine {
    /// Those of AVX2, with the proof that this processor has them.
    #[cfg(target_arch = "x86_64")]
    Avx2(pulp::x86::V3),
    /// Plain Rust.
    Portable,
}

impl Machine {
    /// The best that this processor has.
    pub(crate) fn best() -> Self {
        #[cfg(target_arch = "x86_64")]
        if let Some(simd) = pulp::x86::V3::try_new() {
            return Self::Avx2(simd);
        }
        Self::Portable
    }
}

pub(crate) fn match_with(
    left: &GrayImage,
    right: &GrayImage,
    settings: &MatchSettings,
    machine: Machine,
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
        dispatch(Strip { left, right, settings, first, lead: LEAD_ROWS.min(first), out }, machine);
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

/// Chooses the code compiled for the number of disparities.
fn dispatch(strip: Strip<'_>, machine: Machine) {
    match (strip.settings.disparities as usize).div_ceil(LANES) {
        0..=1 => run::<1>(strip, machine),
        2 => run::<2>(strip, machine),
        3 => run::<3>(strip, machine),
        4 => run::<4>(strip, machine),
        5..=6 => run::<6>(strip, machine),
        _ => run::<8>(strip, machine),
    }
}

/// Chooses the code compiled for this processor.
fn run<const N: usize>(strip: Strip<'_>, machine: Machine) {
    match machine {
        #[cfg(target_arch = "x86_64")]
        Machine::Avx2(simd) => simd.vectorize(WithAvx2::<N> { simd, strip }),
        Machine::Portable => match_rows::<_, N>(Portable, strip),
    }
}

#[cfg(target_arch = "x86_64")]
struct WithAvx2<'a, const N: usize> {
    simd: pulp::x86::V3,
    strip: Strip<'a>,
}

#[cfg(target_arch = "x86_64")]
impl<const N: usize> pulp::NullaryFnOnce for WithAvx2<'_, N> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        match_rows::<_, N>(self.simd, self.strip);
    }
}

/// Matches the rows of a strip, one after the other. Everything below is inlined into one function, so that all of it is
/// compiled for the processor it was chosen for.
#[inline(always)]
fn match_rows<L: Lanes, const N: usize>(lanes: L, strip: Strip<'_>) {
    let Strip { left, right, settings, first, lead, out } = strip;
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

#[cfg(test)]
mod tests {
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

    #[test]
    fn every_machine_gives_the_same_bits() {
        for count in [32, 64, 96, 128, 192, 256] {
            let left = noise(150, 30, u64::from(count));
            let right = shifted(&left, 13, 5);
            let settings = MatchSettings { disparities: count, ..MatchSettings::default() };
            let best = match_with(&left, &right, &settings, Machine::best(), STRIP_ROWS).unwrap();
            let portable = match_with(&left, &right, &settings, Machine::Portable, STRIP_ROWS).unwrap();
            assert_eq!(best, portable, "{count}");
        }
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
        let whole = match_with(&left, &right, &settings, Machine::best(), 10_000).unwrap();
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
