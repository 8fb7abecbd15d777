//! Colour differences that see chroma more than shading, and colour histograms.

/// Weight of lightness against chroma in [`difference`]: shading changes lightness, cloth changes both.
const LIGHTNESS: f32 = 0.4;
/// Histogram cells along L, a and b.
const CELLS: [usize; 3] = [10, 14, 14];
/// Extent of a cell along L, a and b.
const CELL: [f32; 3] = [10.0, 12.0, 12.0];

/// CIELAB (D65, 2°) of an sRGB colour.
pub fn lab(rgb: [u8; 3]) -> [f32; 3] {
    let linear = rgb.map(|c| {
        let c = f32::from(c) / 255.0;
        if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    });
    let [r, g, b] = linear;
    let x = (0.4124 * r + 0.3576 * g + 0.1805 * b) / 0.95047;
    let y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
    let z = (0.0193 * r + 0.1192 * g + 0.9505 * b) / 1.08883;
    let f = |t: f32| if t > 0.008856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 };
    [116.0 * f(y) - 16.0, 500.0 * (f(x) - f(y)), 200.0 * (f(y) - f(z))]
}

/// Distance of two CIELAB colours with lightness weighted down.
pub fn difference(a: &[f32; 3], b: &[f32; 3]) -> f32 {
    let l = LIGHTNESS * (a[0] - b[0]);
    (l * l + (a[1] - b[1]).powi(2) + (a[2] - b[2]).powi(2)).sqrt()
}

/// A smoothed histogram over CIELAB.
#[derive(Debug, Clone)]
pub struct Histogram {
    cells: Vec<f32>,
    total: f32,
}

impl Default for Histogram {
    fn default() -> Self {
        Self { cells: vec![0.0; CELLS.iter().product()], total: 0.0 }
    }
}

impl Histogram {
    /// Adds a colour with a weight (its area), spread over the cells around it.
    pub fn add(&mut self, color: &[f32; 3], weight: f32) {
        for (cell, share) in around(color) {
            self.cells[cell] += weight * share;
        }
        self.total += weight;
    }

    /// Share of the weight whose colour is about this one: within a cell of it. Zero for an empty histogram.
    pub fn share(&self, color: &[f32; 3]) -> f32 {
        let here: f32 = around(color).map(|(cell, _)| self.cells[cell]).sum();
        if self.total > 0.0 { here / self.total } else { 0.0 }
    }

    /// Probability density at a colour, relative to an even spread over all cells, mixed with 1 % of that even spread.
    pub fn density(&self, color: &[f32; 3]) -> f32 {
        let count = self.cells.len() as f32;
        let here: f32 = around(color).map(|(cell, share)| self.cells[cell] * share).sum();
        if self.total > 0.0 { 0.99 * here / self.total * count + 0.01 * 50.0 } else { 1.0 }
    }
}

/// The eight cells around a colour with their trilinear shares.
fn around(color: &[f32; 3]) -> impl Iterator<Item = (usize, f32)> {
    let mut base = [0usize; 3];
    let mut part = [0.0f32; 3];
    for k in 0..3 {
        let origin = if k == 0 { 0.0 } else { -0.5 * CELL[k] * CELLS[k] as f32 };
        let at = ((color[k] - origin) / CELL[k] - 0.5).clamp(0.0, (CELLS[k] - 1) as f32 - 1e-3);
        (base[k], part[k]) = (at as usize, at.fract());
    }
    (0..8).map(move |corner| {
        let (mut index, mut share) = (0, 1.0);
        for k in 0..3 {
            let up = corner >> k & 1;
            index = index * CELLS[k] + base[k] + up;
            share *= if up == 1 { part[k] } else { 1.0 - part[k] };
        }
        (index, share)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_colours() {
        let close = |a: [f32; 3], b: [f32; 3]| a.iter().zip(&b).all(|(x, y)| (x - y).abs() < 0.5);
        assert!(close(lab([255, 255, 255]), [100.0, 0.0, 0.0]));
        assert!(close(lab([0, 0, 0]), [0.0, 0.0, 0.0]));
        assert!(close(lab([255, 0, 0]), [53.2, 80.1, 67.2]));
    }

    #[test]
    fn a_histogram_prefers_what_it_saw() {
        let mut h = Histogram::default();
        (0..100).for_each(|_| h.add(&lab([200, 30, 30]), 1.0));
        assert!(h.density(&lab([205, 35, 30])) > 20.0 * h.density(&lab([30, 30, 200])));
        assert_eq!(Histogram::default().density(&[0.0; 3]), 1.0);
        h.add(&lab([30, 30, 200]), 100.0);
        let shares = [[202, 32, 30], [30, 30, 200], [30, 200, 30]].map(|rgb| h.share(&lab(rgb)));
        assert!(shares.iter().zip([0.5, 0.5, 0.0]).all(|(a, b)| (a - b).abs() < 1e-3), "{shares:?}");
    }
}
