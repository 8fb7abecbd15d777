//! Pictures between their pixels: cubic B-splines (Unser, Aldroubi and Eden 1993).
//!
//! Bilinear look-up halves the contrast of a stripe two and a half pixels wide; the spline that passes through all pixels
//! keeps nearly all of it. A pixel itself is the mean over its square, which the coefficients undo as well: see [`APERTURE`].

/// Number of a full white.
pub(crate) const ONE: f32 = 8192.0;
/// The pole of the cubic spline's inverse filter: √3 − 2.
const POLE: f32 = -0.267_949_2;
/// What the filter's last value is made with.
const END: f32 = POLE / (POLE * POLE - 1.0);
/// Pixels after which the filter's memory is below a thousandth.
const REACH: usize = 6;
/// Share of the mean over a pixel's square that is undone. The mean over a square takes 1/24 of the second difference off along each
/// axis, so that subtracting this share of it gives back what lies in its middle, to the fourth order.
const APERTURE: f32 = 1.0 / 24.0;

/// Coefficients of the spline through pixels in linear light (0 to 1) in rows of `width`.
pub(crate) fn coefficients(mut pixels: Vec<[f32; 3]>, width: usize) -> Vec<[i16; 3]> {
    pixels.chunks_exact_mut(width).for_each(along);
    down(pixels.as_flattened_mut(), 3 * width);
    let number = |c: f32| (c * ONE).round().clamp(-32768.0, 32767.0) as i16;
    pixels.into_iter().map(|pixel| pixel.map(number)).collect()
}

/// Filters a row: undoes the mean over pixels, then makes it coefficients.
fn along(row: &mut [[f32; 3]]) {
    let last = row.len() - 1;
    let mut before = row[0];
    for i in 0..=last {
        let (own, after) = (row[i], row[(i + 1).min(last)]);
        (0..3).for_each(|k| row[i][k] += APERTURE * (2.0 * own[k] - before[k] - after[k]));
        before = own;
    }
    row[0] = start(|i, k| row[i.min(last)][k]);
    for i in 1..=last {
        (0..3).for_each(|k| row[i][k] += POLE * row[i - 1][k]);
    }
    (0..3).for_each(|k| row[last][k] = END * (row[last][k] + POLE * row[last - 1][k]));
    for i in (0..last).rev() {
        (0..3).for_each(|k| row[i][k] = POLE * (row[i + 1][k] - row[i][k]));
    }
    row.iter_mut().flatten().for_each(|c| *c *= 6.0);
}

/// The same for all columns at once; `step` numbers a row.
fn down(values: &mut [f32], step: usize) {
    let rows = values.len() / step;
    let mut before = values[..step].to_vec();
    for v in 0..rows {
        let after = if v + 1 < rows { values[(v + 1) * step..][..step].to_vec() } else { values[v * step..].to_vec() };
        let row = &mut values[v * step..][..step];
        for i in 0..step {
            let own = row[i];
            row[i] += APERTURE * (2.0 * own - before[i] - after[i]);
            before[i] = own;
        }
    }
    let first: Vec<f32> =
        (0..step).map(|i| (0..REACH.min(rows)).map(|v| values[v * step + i] * POLE.powi(v as i32)).sum()).collect();
    values[..step].copy_from_slice(&first);
    for v in 1..rows {
        let (above, row) = values.split_at_mut(v * step);
        row[..step].iter_mut().zip(&above[(v - 1) * step..]).for_each(|(c, a)| *c += POLE * a);
    }
    let (above, last) = values.split_at_mut((rows - 1) * step);
    last.iter_mut().zip(&above[(rows - 2) * step..]).for_each(|(c, a)| *c = END * (*c + POLE * a));
    for v in (0..rows - 1).rev() {
        let (row, below) = values.split_at_mut((v + 1) * step);
        row[v * step..].iter_mut().zip(&below[..step]).for_each(|(c, b)| *c = POLE * (b - *c));
    }
    values.iter_mut().for_each(|c| *c *= 6.0);
}

/// The filter's first value: what it would have gathered before the picture, were that mirrored.
fn start(at: impl Fn(usize, usize) -> f32) -> [f32; 3] {
    std::array::from_fn(|k| (0..REACH).map(|i| at(i, k) * POLE.powi(i as i32)).sum())
}

/// The four weights at a fraction between two pixels, for the pixels −1, 0, 1 and 2.
#[inline]
pub(crate) fn weights(t: f32) -> [f32; 4] {
    let (s, t2) = (1.0 - t, t * t);
    let t3 = t2 * t;
    [s * s * s / 6.0, (3.0 * t3 - 6.0 * t2 + 4.0) / 6.0, (-3.0 * t3 + 3.0 * t2 + 3.0 * t + 1.0) / 6.0, t3 / 6.0]
}

/// The spline at column `x`, row `y`, linear light; held inside of the picture.
#[inline]
pub(crate) fn at(coefficients: &[[i16; 3]], width: usize, height: usize, x: f32, y: f32) -> [f32; 3] {
    let x = x.clamp(1.0, width as f32 - 3.001);
    let y = y.clamp(1.0, height as f32 - 3.001);
    let (u, v) = (x as usize, y as usize);
    let (wx, wy) = (weights(x - u as f32), weights(y - v as f32));
    // Four pixels of a row are twelve numbers side by side: rows are summed first.
    let mut sum = [0.0f32; 12];
    for (j, wy) in wy.into_iter().enumerate() {
        let first = (v + j - 1) * width + u - 1;
        let row = coefficients[first..first + 4].as_flattened();
        for (sum, c) in sum.iter_mut().zip(row) {
            *sum += wy * f32::from(*c);
        }
    }
    std::array::from_fn(|k| {
        (wx[0] * sum[k] + wx[1] * sum[3 + k] + wx[2] * sum[6 + k] + wx[3] * sum[9 + k]) * (1.0 / ONE)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sine whose pixels are means over their squares comes back as itself, pixels apart or between them.
    #[test]
    fn a_stripe_keeps_its_contrast_between_pixels() {
        let (width, height, period) = (64, 48, 6.0f64);
        let wave = std::f64::consts::TAU / period;
        let mean = |u: usize| {
            let u = u as f64;
            0.5 + 0.3 * ((wave * (u - 0.5)).cos() - (wave * (u + 0.5)).cos()) / wave
        };
        let pixels = (0..width * height).map(|i| [mean(i % width) as f32; 3]).collect();
        let spline = coefficients(pixels, width);
        for step in 0..200 {
            let x = 12.0 + 0.2 * f64::from(step);
            let found = at(&spline, width, height, x as f32, 20.3)[1];
            let true_value = 0.5 + 0.3 * (wave * x).sin();
            assert!((f64::from(found) - true_value).abs() < 0.012, "{found} is not {true_value} at {x}");
        }
    }
}
