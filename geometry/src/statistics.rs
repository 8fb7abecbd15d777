//! Medians, quantiles and robust spreads of samples.
//!
//! All functions order their samples in place (NaN last) and return `None` where there are none. A quantile is always
//! one of the samples, never a value between two: [`Rank`] says which.

use std::cmp::Ordering;

/// The standard deviation of normally distributed samples over their median absolute deviation.
pub const SIGMA_PER_MAD: f64 = 1.4826;

/// A floating-point number that statistics can order.
pub trait Sample: Copy {
    /// The total order of IEEE 754: NaN comes after +∞.
    fn total_cmp(&self, other: &Self) -> Ordering;
    /// Distance to another sample.
    fn distance(self, other: Self) -> Self;
}

macro_rules! sample {
    ($number:ty) => {
        impl Sample for $number {
            #[inline]
            fn total_cmp(&self, other: &Self) -> Ordering {
                <$number>::total_cmp(self, other)
            }
            #[inline]
            fn distance(self, other: Self) -> Self {
                (self - other).abs()
            }
        }
    };
}
sample!(f32);
sample!(f64);

/// Which of n samples in ascending order is the quantile at share q: the rank, counted from 0, at most n − 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Rank {
    /// (n − 1) q, rounded to the nearest.
    #[default]
    Nearest,
    /// (n − 1) q, rounded down.
    Below,
    /// n q, rounded down: the first sample that at least the share q lies below.
    Count,
}

impl Rank {
    /// Rank of the quantile at share `q` (0 to 1) among `count` samples.
    pub fn of(self, count: usize, q: f64) -> usize {
        let last = count.saturating_sub(1);
        let rank = match self {
            Self::Nearest => (last as f64 * q).round(),
            Self::Below => last as f64 * q,
            Self::Count => count as f64 * q,
        };
        (rank as usize).min(last)
    }
}

/// The middle sample; of an even number, the upper of the two in the middle. O(n).
pub fn median<T: Sample>(samples: &mut [T]) -> Option<T> {
    select(samples, samples.len() / 2)
}

/// The sample at share `q` (0 to 1), by the nearest rank. O(n).
pub fn quantile<T: Sample>(samples: &mut [T], q: f64) -> Option<T> {
    quantile_by(samples, q, Rank::Nearest)
}

/// The sample at share `q` (0 to 1), by a rank of your choice. O(n).
pub fn quantile_by<T: Sample>(samples: &mut [T], q: f64, rank: Rank) -> Option<T> {
    select(samples, rank.of(samples.len(), q))
}

/// The sample at share `q` (0 to 1) of samples in ascending order, by a rank of your choice. O(1).
pub fn quantile_of_sorted<T: Sample>(ascending: &[T], q: f64, rank: Rank) -> Option<T> {
    ascending.get(rank.of(ascending.len(), q)).copied()
}

/// Median distance of the samples to their median. Overwrites the samples with these distances. O(n).
pub fn median_absolute_deviation<T: Sample>(samples: &mut [T]) -> Option<T> {
    let center = median(samples)?;
    samples.iter_mut().for_each(|s| *s = s.distance(center));
    median(samples)
}

/// Robust standard deviation of samples about zero, from their absolute values: [`SIGMA_PER_MAD`] times the median. O(n).
pub fn sigma_about_zero(absolute: &mut [f64]) -> Option<f64> {
    Some(SIGMA_PER_MAD * median(absolute)?)
}

/// Sorts samples in ascending order, NaN last.
pub fn sort<T: Sample>(samples: &mut [T]) {
    samples.sort_unstable_by(T::total_cmp);
}

fn select<T: Sample>(samples: &mut [T], rank: usize) -> Option<T> {
    (rank < samples.len()).then(|| *samples.select_nth_unstable_by(rank, T::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_are_those_of_the_sorted_samples() {
        for count in 1..60usize {
            let samples: Vec<f64> = (0..count).map(|i| ((i * 37) % 61) as f64).collect();
            let mut sorted = samples.clone();
            sort(&mut sorted);
            assert_eq!(median(&mut samples.clone()), Some(sorted[count / 2]));
            for q in [0.0, 0.16, 0.5, 0.95, 1.0] {
                let last = (count - 1) as f64;
                let expected = [(last * q).round(), (last * q).floor(), (count as f64 * q).floor().min(last)];
                for (rank, at) in [Rank::Nearest, Rank::Below, Rank::Count].into_iter().zip(expected) {
                    let found = quantile_by(&mut samples.clone(), q, rank);
                    assert_eq!(found, Some(sorted[at as usize]), "{count} {q} {rank:?}");
                    assert_eq!(quantile_of_sorted(&sorted, q, rank), found);
                }
            }
        }
    }

    #[test]
    fn spread_does_not_follow_outliers() {
        let samples = [1.0f64, 2.0, 3.0, 4.0, 1e9];
        assert_eq!(median_absolute_deviation(&mut samples.clone()), Some(1.0));
        assert_eq!(sigma_about_zero(&mut samples.clone()), Some(3.0 * SIGMA_PER_MAD));
        assert_eq!(median(&mut [2.0f32, f32::NAN, 1.0]), Some(2.0));
    }

    #[test]
    fn no_samples_have_no_statistics() {
        assert_eq!(median::<f64>(&mut []), None);
        assert_eq!(quantile::<f32>(&mut [], 0.5), None);
        assert_eq!(median_absolute_deviation::<f64>(&mut []), None);
        assert_eq!(quantile_of_sorted::<f64>(&[], 1.0, Rank::Count), None);
    }
}
