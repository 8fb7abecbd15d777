//! Whether anybody has such measures.
//!
//! The logarithms of the measures are taken as normal over the model's population, to first order around the start. A measure that
//! nobody has, alone or beside another one, is refused with the range that people have.

use super::{names::Row, shapes::Population};
use crate::FittingError;

/// Farthest from the mean, or from what another measure lets expect, that somebody is believed to be, standard deviations. Measures of a
/// large sample reach 6 (`measure::plausible`); half a deviation is for people whom the model was not made from. The hundred people of
/// ANSUR II in `fitting/tests/by_measures.rs`, from thin to heavy, stay within it.
const BELIEVED: f64 = 6.5;
/// The range that is told, standard deviations.
const USUAL: f64 = 3.0;

/// # Errors
/// [`FittingError::Measure`] names the first measure, or the worst pair, that nobody has.
pub(super) fn check(rows: &[Row], population: &Population) -> Result<(), FittingError> {
    let law = Law { rows, population };
    for (r, row) in rows.iter().enumerate() {
        let (mean, deviation) = (population.log_mean[r], law.covariance(r, r).sqrt());
        if (row.wanted.ln() - mean).abs() > BELIEVED * deviation {
            let range = range(mean, deviation);
            let reason = format!(
                "nobody has a {} of {:.2} m: nearly everybody has {range}; is it in metres?",
                row.name, row.wanted
            );
            return Err(FittingError::Measure(reason));
        }
    }
    let pairs = (0..rows.len()).flat_map(|a| (0..rows.len()).filter(move |b| *b != a).map(move |b| (a, b)));
    let worst = pairs.map(|(a, b)| (law.distance(a, b), a, b)).fold((0.0, 0, 0), |w, x| if x.0 > w.0 { x } else { w });
    let (distance, a, b) = worst;
    if distance <= BELIEVED {
        return Ok(());
    }
    let (mean, deviation) = law.beside(a, b);
    Err(FittingError::Measure(format!(
        "nobody has a {} of {:.2} m and a {} of {:.2} m: beside the latter the former is {}; change one of the two",
        rows[a].name,
        rows[a].wanted,
        rows[b].name,
        rows[b].wanted,
        range(mean, deviation)
    )))
}

fn range(mean: f64, deviation: f64) -> String {
    let [low, high] = [-USUAL, USUAL].map(|k| (mean + k * deviation).exp());
    format!("{low:.2} to {high:.2} m")
}

/// The joint distribution of the logarithms.
struct Law<'a> {
    rows: &'a [Row],
    population: &'a Population,
}

impl Law<'_> {
    /// Of people, and on the diagonal of what a tape may be off.
    fn covariance(&self, a: usize, b: usize) -> f64 {
        let slopes = &self.population.log_slopes;
        let tape = 0.5 * self.rows[a].allowed() / self.rows[a].wanted;
        slopes.row(a).dot(&slopes.row(b)) + if a == b { tape * tape } else { 0.0 }
    }

    /// Mean and deviation of measure `a` of people who have the wanted `b`.
    fn beside(&self, a: usize, b: usize) -> (f64, f64) {
        let slope = self.covariance(a, b) / self.covariance(b, b);
        let mean = self.population.log_mean[a] + slope * (self.rows[b].wanted.ln() - self.population.log_mean[b]);
        let variance = self.covariance(a, a) - slope * self.covariance(a, b);
        (mean, variance.max(0.0).sqrt())
    }

    /// How far the wanted `a` is from what the wanted `b` lets expect, standard deviations.
    fn distance(&self, a: usize, b: usize) -> f64 {
        let (mean, deviation) = self.beside(a, b);
        (self.rows[a].wanted.ln() - mean).abs() / deviation.max(1e-9)
    }
}
