//! Colours for scalars.

/// Nine samples, evenly spaced, of a map from dark blue over green to yellow whose lightness rises steadily (viridis).
const SAMPLES: [[u8; 3]; 9] = [
    [68, 1, 84],
    [71, 44, 122],
    [59, 81, 139],
    [44, 113, 142],
    [33, 144, 141],
    [39, 173, 129],
    [92, 200, 99],
    [170, 220, 50],
    [253, 231, 37],
];

/// Colour of `value` on a scale from `range.0` (dark) to `range.1` (bright); values outside are clamped, NaN is
/// magenta.
pub fn viridis(value: f32, range: (f32, f32)) -> [u8; 3] {
    if !value.is_finite() {
        return [255, 0, 255];
    }
    let span = range.1 - range.0;
    let t = if span.abs() > f32::MIN_POSITIVE { ((value - range.0) / span).clamp(0.0, 1.0) } else { 0.0 };
    let scaled = t * (SAMPLES.len() - 1) as f32;
    let k = (scaled as usize).min(SAMPLES.len() - 2);
    let f = scaled - k as f32;
    std::array::from_fn(|c| (f32::from(SAMPLES[k][c]) * (1.0 - f) + f32::from(SAMPLES[k + 1][c]) * f + 0.5) as u8)
}

/// Colours of many values.
pub fn colors(values: &[f32], range: (f32, f32)) -> Vec<[u8; 3]> {
    values.iter().map(|&v| viridis(v, range)).collect()
}

/// Lowest and highest finite value; (0, 1) where there is none.
pub fn range_of(values: &[f32]) -> (f32, f32) {
    let finite = values.iter().copied().filter(|v| v.is_finite());
    let (lo, hi) = finite.fold((f32::INFINITY, f32::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)));
    if lo <= hi { (lo, hi) } else { (0.0, 1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_clamp_and_nan_stands_out() {
        assert_eq!(viridis(-3.0, (0.0, 1.0)), SAMPLES[0]);
        assert_eq!(viridis(9.0, (0.0, 1.0)), SAMPLES[8]);
        assert_eq!(viridis(0.5, (0.0, 1.0)), SAMPLES[4]);
        assert_eq!(viridis(f32::NAN, (0.0, 1.0)), [255, 0, 255]);
        assert_eq!(range_of(&[f32::NAN, 2.0, -1.0]), (-1.0, 2.0));
    }
}
