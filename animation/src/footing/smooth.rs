//! Smooth curves over the poses of a motion.

/// Mean over `reach` values to both sides, fewer at the ends.
pub(super) fn averaged(values: &[f64], reach: usize) -> Vec<f64> {
    let of = |at: usize| {
        let around = &values[at.saturating_sub(reach)..(at + reach + 1).min(values.len())];
        around.iter().sum::<f64>() / around.len() as f64
    };
    (0..values.len()).map(of).collect()
}

/// A smooth curve that is nowhere below `values`: the highest within `reach` to both sides, averaged over as many.
pub(super) fn envelope(values: &[f64], reach: usize) -> Vec<f64> {
    let highest = |at: usize| {
        let around = &values[at.saturating_sub(reach)..(at + reach + 1).min(values.len())];
        around.iter().copied().fold(f64::NEG_INFINITY, f64::max)
    };
    let highest: Vec<f64> = (0..values.len()).map(highest).collect();
    averaged(&highest, reach)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_envelope_is_above_its_values_and_has_no_jump() {
        let values: Vec<f64> = (0..60).map(|k| if k == 30 { 1.0 } else { 0.0 }).collect();
        let smooth = envelope(&values, 5);
        assert!(smooth.iter().zip(&values).all(|(s, v)| s >= v));
        assert!(smooth.windows(2).all(|p| (p[1] - p[0]).abs() < 0.1), "{smooth:?}");
        assert_eq!((smooth[15], smooth[45]), (0.0, 0.0));
    }
}
