//! The disparity of the smallest sum, its fraction, and whether another comes close.

use toile_geometry::lanes::bytes::{LANES, Lanes};

/// The winner of a pixel.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Winner {
    /// Index of the disparity.
    pub index: u16,
    /// The offset to add to it, −0.5 to 0.5 pixels.
    pub fraction: f32,
    /// True where all but its two neighbours cost clearly more, and both neighbours were searched.
    pub is_unique: bool,
}

/// The first of the smallest sums of a pixel.
#[inline(always)]
pub(crate) fn winner<L: Lanes, const N: usize>(lanes: L, sums: &[[u16; LANES]; N], uniqueness: f32) -> Winner {
    let none = lanes.splat_words(u16::MAX);
    let mut lowest = none;
    for sums in sums {
        lowest = lanes.min_words(lowest, lanes.load_words(sums));
    }
    let best = lanes.smallest_word(lowest);
    let limit = (f32::from(best) * (1.0 + uniqueness)) as u16;
    let (best_lanes, limit_lanes) = (lanes.splat_words(best), lanes.splat_words(limit));
    let mut first = none;
    let mut close = lanes.splat_words(0);
    for (k, sums) in sums.iter().enumerate() {
        let sums = lanes.load_words(sums);
        first = lanes.min_words(first, lanes.select_le(sums, best_lanes, lanes.ramp((k * LANES) as u16), none));
        close = lanes.count_le(close, sums, limit_lanes);
    }
    let index = lanes.smallest_word(first);
    judge(sums.as_flattened(), index, limit, lanes.sum_words(close))
}

/// `close` counts the sums up to `limit`; the winner and its neighbours are allowed.
#[inline(always)]
fn judge(sums: &[u16], index: u16, limit: u16, close: u16) -> Winner {
    let i = usize::from(index);
    if i == 0 || i + 1 >= sums.len() {
        return Winner { index, fraction: 0.0, is_unique: false };
    }
    let (before, best, after) = (sums[i - 1], sums[i], sums[i + 1]);
    let own = 1 + u16::from(before <= limit) + u16::from(after <= limit);
    Winner { index, fraction: fraction(before, best, after), is_unique: close <= own }
}

/// Where two lines of opposite equal slope through the three sums meet. Hamming distances grow linearly with the
/// distance from the match, so that this is less biased towards whole pixels than a parabola.
#[inline(always)]
fn fraction(before: u16, best: u16, after: u16) -> f32 {
    let slope = before.max(after) - best;
    if slope == 0 {
        return 0.0;
    }
    (f32::from(before) - f32::from(after)) / (2.0 * f32::from(slope))
}

#[cfg(test)]
mod tests {
    use super::*;
    use toile_geometry::lanes::bytes::Portable;

    #[test]
    fn lines_that_meet_between_two_disparities_give_the_fraction() {
        for tenths in -5..=5 {
            let truth = 10.0 + f32::from(tenths as i16) / 10.0;
            let sums: [u16; LANES] = std::array::from_fn(|d| (100.0 + 50.0 * (d as f32 - truth).abs()).round() as u16);
            let found = winner(Portable, &[sums], 0.0);
            assert!((f32::from(found.index) + found.fraction - truth).abs() < 0.011, "{truth}: {found:?}");
        }
    }

    #[test]
    fn a_rival_is_refused_and_neighbours_are_not() {
        let mut sums = [500u16; LANES];
        (sums[9], sums[10], sums[11]) = (102, 100, 101);
        assert!(winner(Portable, &[sums], 0.1).is_unique);
        sums[20] = 109;
        assert!(!winner(Portable, &[sums], 0.1).is_unique);
        sums[20] = 111;
        assert!(winner(Portable, &[sums], 0.1).is_unique);
    }

    #[test]
    fn the_ends_of_the_search_are_no_answer() {
        let mut sums = [500u16; LANES];
        sums[0] = 1;
        assert!(!winner(Portable, &[sums], 0.1).is_unique);
        sums[0] = 500;
        sums[LANES - 1] = 1;
        assert!(!winner(Portable, &[sums], 0.1).is_unique);
    }
}
