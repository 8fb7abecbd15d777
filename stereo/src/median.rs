//! Median of 3×3 disparities.

use rayon::prelude::*;

/// The median of each value and its eight neighbours where all nine are answered; other values as they are.
pub(crate) fn median(values: &[f32], width: usize) -> Vec<f32> {
    let mut out = values.to_vec();
    let rows = values.len() / width;
    if rows < 3 || width < 3 {
        return out;
    }
    out[width..(rows - 1) * width].par_chunks_exact_mut(width).enumerate().for_each(|(v, out)| {
        let row = |k: usize| &values[(v + k) * width..][..width];
        smooth_row([row(0), row(1), row(2)], &mut out[1..width - 1]);
    });
    out
}

/// Selects the middle of nine by minima and maxima alone (Paeth, Graphics Gems 1990), so that the loop is vectorised.
fn smooth_row(rows: [&[f32]; 3], out: &mut [f32]) {
    for (x, out) in out.iter_mut().enumerate() {
        let columns: [[f32; 3]; 3] = std::array::from_fn(|k| sorted([rows[0][x + k], rows[1][x + k], rows[2][x + k]]));
        let [a, b, c] = columns;
        let lows = a[0].max(b[0]).max(c[0]);
        let middles = sorted([a[1], b[1], c[1]])[1];
        let highs = a[2].min(b[2]).min(c[2]);
        let smallest = a[0].min(b[0]).min(c[0]);
        let median = sorted([lows, middles, highs])[1];
        *out = if smallest > 0.0 { median } else { *out };
    }
}

#[inline(always)]
fn sorted([a, b, c]: [f32; 3]) -> [f32; 3] {
    let (low, high) = (a.min(b), a.max(b));
    [low.min(c), low.max(high.min(c)), high.max(c)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_sorting() {
        let (w, h) = (9, 7);
        let values: Vec<f32> = (0..w * h).map(|i| if i == 40 { 0.0 } else { ((i * 37) % 101 + 1) as f32 }).collect();
        let smooth = median(&values, w);
        for v in 0..h {
            for u in 0..w {
                let mut expected = values[v * w + u];
                if (1..w - 1).contains(&u) && (1..h - 1).contains(&v) {
                    let mut nine: Vec<f32> = (0..9).map(|k| values[(v + k / 3 - 1) * w + u + k % 3 - 1]).collect();
                    nine.sort_by(f32::total_cmp);
                    expected = if nine[0] > 0.0 { nine[4] } else { expected };
                }
                assert_eq!(smooth[v * w + u], expected, "{u} {v}");
            }
        }
    }
}
