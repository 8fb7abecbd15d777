//! Which of the takes before a take is worn as: something may have been taken off in between.

use super::report::UnderFit;

/// With more than this share of the take before outside the scan, earlier takes are tried.
const OUTSIDE: f64 = 0.1;
/// An earlier take is believed with at most this share of what lies outside of the take before.
const BELIEVED: f64 = 0.5;

/// The take whose scan is seen again, by its index, with the fit of it: the last of `takes`, or an earlier one where much
/// of the last is outside the scan and little of the earlier one is. `fit_as` poses one take under the scan
/// ([`crate::pose_under`]).
///
/// Loose cloth that swung is outside too, but then less, not more of an earlier take is seen again. A failed fit of an
/// earlier take is passed over.
///
/// # Errors
/// The result of `fit_as` for the last take. `takes` must be 1 or more.
pub fn pose_as_worn<E>(
    takes: usize,
    mut fit_as: impl FnMut(usize) -> Result<UnderFit, E>,
) -> Result<(usize, UnderFit), E> {
    let last = takes.saturating_sub(1);
    let (mut worn, mut fit) = (last, fit_as(last)?);
    for earlier in (0..last).rev() {
        if fit.report.outside <= OUTSIDE {
            break;
        }
        let Ok(other) = fit_as(earlier) else { continue };
        let is_seen_better =
            other.report.verdict <= fit.report.verdict && other.report.uncovered >= fit.report.uncovered;
        if is_seen_better && other.report.outside < BELIEVED * fit.report.outside {
            (worn, fit) = (earlier, other);
        }
    }
    Ok((worn, fit))
}

#[cfg(test)]
mod tests {
    use toile_character::Pose;

    use super::*;
    use crate::{UnderReport, Verdict};

    /// A fit with the given shares uncovered and outside.
    fn fit((uncovered, outside): (f64, f64)) -> UnderFit {
        let report = UnderReport {
            verdict: Verdict::Trusted,
            reasons: Vec::new(),
            iterations: 0,
            converged: true,
            heading_deg: 0.0,
            uncovered,
            uncovered_rms_mm: 0.0,
            outside,
        };
        UnderFit { pose: Pose::identity(), uncovered: Vec::new(), report }
    }

    fn worn(takes: &[(f64, f64)]) -> usize {
        pose_as_worn::<()>(takes.len(), |k| Ok(fit(takes[k]))).unwrap().0
    }

    #[test]
    fn an_earlier_take_is_found_where_something_was_taken_off_and_not_where_a_coat_swung() {
        assert_eq!(worn(&[(0.9, 0.0), (0.3, 0.05)]), 1, "little is outside: the last take is worn");
        assert_eq!(worn(&[(0.5, 0.01), (0.3, 0.3)]), 0, "taken off");
        assert_eq!(worn(&[(0.2, 0.01), (0.3, 0.3)]), 1, "less is seen again: cloth that swung");
        assert_eq!(worn(&[(0.5, 0.2), (0.3, 0.3)]), 1, "much of the earlier take is outside, too");
        let failing = pose_as_worn(2, |k| if k == 0 { Err("no") } else { Ok(fit((0.3, 0.3))) }).unwrap();
        assert_eq!(failing.0, 1);
        assert!(pose_as_worn(1, |_| Err::<UnderFit, _>("no")).is_err());
    }
}
