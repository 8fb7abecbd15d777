//! Least squares under the rules of skin weights.

use nalgebra::{SMatrix, SVector};

/// At most so many joints are weighed against each other for a vertex.
pub(super) const CANDIDATES: usize = 10;

/// Scalar products of what each candidate misses the vertex by, over all frames.
pub(super) type Gram = SMatrix<f64, CANDIDATES, CANDIDATES>;
pub(super) type Weights = SVector<f64, CANDIDATES>;

/// Weights that are not negative, sum to 1, at most `most` of them above 0, and make w' G w small; the first `count` candidates count.
///
/// Without the limit on their number it is the smallest (active set method); then the smallest weights are dropped
/// one by one, the others found anew (Le and Deng 2012, section 4.1).
pub(super) fn on_simplex(gram: &Gram, count: usize, most: usize) -> Weights {
    let mut active: [bool; CANDIDATES] = std::array::from_fn(|i| i < count);
    let mut weights = without_negative(gram, &mut active);
    for _ in 0..2 * CANDIDATES {
        // A candidate that was dropped comes back where w' G w would fall with its weight.
        let slope = gram * weights;
        let level = weights.dot(&slope);
        let falls = |&i: &usize| !active[i] && slope[i] < level * (1.0 - 1e-9);
        let Some(back) = (0..count).filter(falls).min_by(|&a, &b| slope[a].total_cmp(&slope[b])) else { break };
        let before = active;
        active[back] = true;
        let next = without_negative(gram, &mut active);
        if active == before || next.dot(&(gram * next)) >= level {
            active = before;
            break;
        }
        weights = next;
    }
    while active.iter().filter(|a| **a).count() > most {
        let smallest = (0..count).filter(|&i| active[i]).min_by(|&a, &b| weights[a].total_cmp(&weights[b]));
        smallest.into_iter().for_each(|i| active[i] = false);
        weights = without_negative(gram, &mut active);
    }
    weights
}

/// The best weights of the `active` candidates; those that would be negative are made inactive, the most negative first.
fn without_negative(gram: &Gram, active: &mut [bool; CANDIDATES]) -> Weights {
    loop {
        let weights = on_plane(gram, active);
        let lowest = (0..CANDIDATES).filter(|&i| active[i]).min_by(|&a, &b| weights[a].total_cmp(&weights[b]));
        match lowest.filter(|&i| weights[i] < 0.0) {
            Some(i) => active[i] = false,
            None => return weights,
        }
    }
}

/// The weights of sum 1, of any sign, that make w' G w smallest; inactive ones are 0.
fn on_plane(gram: &Gram, active: &[bool; CANDIDATES]) -> Weights {
    let one = |i: usize| if active[i] { 1.0 } else { 0.0 };
    let reduced = Gram::from_fn(|i, j| if i == j && !active[i] { 1.0 } else { one(i) * one(j) * gram[(i, j)] });
    let ones = Weights::from_fn(|i, _| one(i));
    let solved = reduced.cholesky().map_or(ones, |c| c.solve(&ones));
    solved / solved.sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What candidates miss a vertex by: directions in space of 12 dimensions.
    fn gram(seed: u32, count: usize) -> Gram {
        let mut state = seed.wrapping_mul(747_796_405).wrapping_add(1);
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 24) - 0.4
        };
        let misses: Vec<[f64; 12]> = (0..count).map(|_| std::array::from_fn(|_| next())).collect();
        let dot = |i: usize, j: usize| (0..12).map(|k| misses[i][k] * misses[j][k]).sum::<f64>();
        Gram::from_fn(|i, j| if i < count && j < count { dot(i, j) } else { 0.0 })
    }

    #[test]
    fn three_candidates_agree_with_a_fine_grid() {
        for seed in 0..200 {
            let g = gram(seed, 3);
            let found = on_simplex(&g, 3, 3);
            let value = |w: &Weights| w.dot(&(g * w));
            let best = (0..=200).flat_map(|a| (0..=200 - a).map(move |b| [f64::from(a), f64::from(b)]));
            let best = best.map(|[a, b]| {
                let mut w = Weights::zeros();
                (w[0], w[1], w[2]) = (a / 200.0, b / 200.0, 1.0 - (a + b) / 200.0);
                value(&w)
            });
            let best = best.fold(f64::INFINITY, f64::min);
            assert!(value(&found) <= best + 1e-12, "{seed}: {} {best}", value(&found));
            assert!((found.sum() - 1.0).abs() < 1e-12 && found.min() >= 0.0);
        }
    }

    #[test]
    fn no_more_candidates_count_than_are_allowed() {
        for seed in 0..50 {
            let found = on_simplex(&gram(seed, 9), 9, 4);
            assert!(found.iter().filter(|w| **w > 0.0).count() <= 4);
            assert!((found.sum() - 1.0).abs() < 1e-12 && found.min() >= 0.0);
            assert_eq!(found[9], 0.0);
        }
    }

    #[test]
    fn the_candidate_that_fits_gets_everything() {
        let mut g = gram(4, 5);
        (0..5).for_each(|i| (g[(2, i)], g[(i, 2)]) = (0.0, 0.0));
        g[(2, 2)] = 1e-12;
        assert!(on_simplex(&g, 5, 4)[2] > 0.999);
    }
}
