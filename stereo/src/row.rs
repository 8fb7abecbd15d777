//! One row at a time: matching costs, path costs, the winners and what speaks against them.

use toile_geometry::lanes::bytes::{LANES, Lanes};

use crate::{
    census::{BITS, Census, PLANES},
    path::{PathRow, Penalties, step},
    settings::MatchSettings,
    winner::{Winner, winner},
};

/// State of a strip between its rows, and scratch space of one row; `N` vectors of disparities a pixel.
pub(crate) struct RowMatcher<const N: usize> {
    width: usize,
    first_disparity: usize,
    penalties: Penalties,
    uniqueness: f32,
    left_right: u16,
    /// Matching costs of the row: `[x][d]`.
    costs: Vec<[[u8; LANES]; N]>,
    /// Sums of path costs of the row: `[x][d]`.
    sums: Vec<[[u16; LANES]; N]>,
    /// Paths from above left, above and above right: of the row before and of this one.
    above: [PathRow<N>; 3],
    current: [PathRow<N>; 3],
    /// The path along the row: one pixel.
    along: PathRow<N>,
    winners: Vec<Winner>,
    /// The smallest sum of each right pixel, from right to left, and its disparity.
    right_sums: Vec<u16>,
    right_winners: Vec<u16>,
}

impl<const N: usize> RowMatcher<N> {
    /// A matcher of rows `width` pixels wide, before its first row.
    pub fn new(width: usize, settings: &MatchSettings) -> Self {
        let rows = || std::array::from_fn(|_| PathRow::new(width));
        let first_disparity = settings.min_disparity as usize;
        let right = width + first_disparity + N * LANES;
        Self {
            width,
            first_disparity,
            penalties: settings.penalties(),
            uniqueness: settings.uniqueness,
            left_right: u16::try_from(settings.left_right).unwrap_or(u16::MAX),
            costs: vec![[[0; LANES]; N]; width],
            sums: vec![[[0; LANES]; N]; width],
            above: rows(),
            current: rows(),
            along: PathRow::new(1),
            winners: vec![Winner::default(); width],
            right_sums: vec![0; right],
            right_winners: vec![0; right],
        }
    }

    /// Matching costs of row `v` of the two census images (the right one mirrored): differing bits of each pixel and its
    /// candidates; candidates beyond the right image cost the most.
    #[inline(always)]
    pub fn match_row<L: Lanes>(&mut self, lanes: L, left: &Census, right: &Census, v: usize) {
        let (lefts, rights) = (left.planes(v), right.planes(v));
        for (x, costs) in self.costs.iter_mut().enumerate() {
            let start = self.width - 1 - x + self.first_disparity;
            let mut sums = [lanes.splat(0); N];
            for p in 0..PLANES {
                let own = lanes.splat(lefts[p][x]);
                let (candidates, _) = rights[p][start..][..N * LANES].as_chunks();
                for (sum, candidate) in sums.iter_mut().zip(candidates) {
                    *sum = lanes.add(*sum, lanes.differing_bits(own, lanes.load(candidate)));
                }
            }
            for (sum, costs) in sums.into_iter().zip(costs.iter_mut()) {
                lanes.store(sum, costs);
            }
            let seen = (x + 1).saturating_sub(self.first_disparity).min(N * LANES);
            costs.as_flattened_mut()[seen..].fill(BITS);
        }
    }

    /// Four of the five paths, from the left and from above, and their sums.
    #[inline(always)]
    pub fn aggregate_row<L: Lanes>(&mut self, lanes: L) {
        self.along.clear();
        for (x, (costs, sums)) in self.costs.iter().zip(&mut self.sums).enumerate() {
            let costs = load(lanes, costs);
            let mut sum = [lanes.splat_words(0); N];
            let (path, smallest) = step(lanes, costs, self.along.at(1), self.penalties);
            self.along.put(lanes, 1, path, smallest);
            add(lanes, &mut sum, path);
            for (k, (above, current)) in self.above.iter().zip(&mut self.current).enumerate() {
                let (path, smallest) = step(lanes, costs, above.at(x + k), self.penalties);
                current.put(lanes, x + 1, path, smallest);
                add(lanes, &mut sum, path);
            }
            for (slot, sum) in sums.iter_mut().zip(sum) {
                lanes.store_words(sum, slot);
            }
        }
    }

    /// The fifth path, from the right, which completes the sums: the winners of the left and of the right image follow at
    /// once. The row is done with this.
    #[inline(always)]
    pub fn select_row<L: Lanes>(&mut self, lanes: L) {
        self.along.clear();
        self.right_sums.fill(u16::MAX);
        for x in (0..self.width).rev() {
            let (path, smallest) = step(lanes, load(lanes, &self.costs[x]), self.along.at(1), self.penalties);
            self.along.put(lanes, 1, path, smallest);
            let sums = &mut self.sums[x];
            for (sum, path) in sums.iter_mut().zip(path) {
                lanes.store_words(lanes.add_words(lanes.load_words(sum), lanes.widen(path)), sum);
            }
            let start = self.width - 1 - x + self.first_disparity;
            let right_sums = &mut self.right_sums[start..][..N * LANES];
            challenge(lanes, sums, right_sums, &mut self.right_winners[start..][..N * LANES]);
            self.winners[x] = winner(lanes, sums, self.uniqueness);
        }
        std::mem::swap(&mut self.above, &mut self.current);
    }

    /// Disparities of the row that was matched last.
    #[inline(always)]
    pub fn answer(&self, out: &mut [f32]) {
        for (x, (out, winner)) in out.iter_mut().zip(&self.winners).enumerate() {
            let disparity = self.first_disparity + usize::from(winner.index);
            let agrees = disparity <= x && {
                let other = self.right_winners[self.width - 1 - x + disparity];
                other.abs_diff(winner.index) <= self.left_right
            };
            *out = if winner.is_unique && agrees { disparity as f32 + winner.fraction } else { 0.0 };
        }
    }
}

/// Vectors of a pixel. A closure would be compiled without the vector instructions, hence the loop.
#[inline(always)]
fn load<L: Lanes, const N: usize>(lanes: L, from: &[[u8; LANES]; N]) -> [L::Bytes; N] {
    let mut out = [lanes.splat(0); N];
    for (out, from) in out.iter_mut().zip(from) {
        *out = lanes.load(from);
    }
    out
}

#[inline(always)]
fn add<L: Lanes, const N: usize>(lanes: L, sum: &mut [L::Words; N], path: [L::Bytes; N]) {
    for (sum, path) in sum.iter_mut().zip(path) {
        *sum = lanes.add_words(*sum, lanes.widen(path));
    }
}

/// A left pixel's sums challenge the best of the right pixels that its disparities point to. Left pixels come from right
/// to left; the first of equals stays.
#[inline(always)]
fn challenge<L: Lanes, const N: usize>(lanes: L, sums: &[[u16; LANES]; N], right: &mut [u16], winners: &mut [u16]) {
    let (right, _) = right.as_chunks_mut();
    let (winners, _) = winners.as_chunks_mut();
    for (k, ((sum, right), winner)) in sums.iter().zip(right).zip(winners).enumerate() {
        let (sum, smallest) = (lanes.load_words(sum), lanes.load_words(right));
        let index = lanes.select_le(smallest, sum, lanes.load_words(winner), lanes.ramp((k * LANES) as u16));
        lanes.store_words(index, winner);
        lanes.store_words(lanes.min_words(smallest, sum), right);
    }
}
