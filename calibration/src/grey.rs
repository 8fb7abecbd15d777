//! Grey pictures.

use rayon::prelude::*;

/// A grey picture, row by row; pixel centres at integers.
#[derive(Debug, Clone, PartialEq)]
pub struct Grey {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Brightness.
    pub values: Vec<f32>,
}

impl Grey {
    /// From brightness row by row; what is missing is black.
    pub fn new(width: usize, height: usize, mut values: Vec<f32>) -> Self {
        values.resize(width * height, 0.0);
        Self { width, height, values }
    }

    /// From sRGB pixels.
    pub fn from_rgb(width: usize, height: usize, pixels: &[[u8; 3]]) -> Self {
        let grey = |p: &[u8; 3]| 0.299 * f32::from(p[0]) + 0.587 * f32::from(p[1]) + 0.114 * f32::from(p[2]);
        Self::new(width, height, pixels.iter().map(grey).collect())
    }

    /// The value at a pixel; beyond the border that of the nearest one.
    #[inline]
    pub fn at(&self, x: isize, y: isize) -> f32 {
        let x = x.clamp(0, self.width as isize - 1) as usize;
        let y = y.clamp(0, self.height as isize - 1) as usize;
        self.values[y * self.width + x]
    }

    /// Bilinear value.
    pub fn sample(&self, x: f64, y: f64) -> f64 {
        let (x0, y0) = (x.floor(), y.floor());
        let (a, b) = (x - x0, y - y0);
        let value = |dx: isize, dy: isize| f64::from(self.at(x0 as isize + dx, y0 as isize + dy));
        let row = |dy: isize| value(0, dy) * (1.0 - a) + value(1, dy) * a;
        row(0) * (1.0 - b) + row(1) * b
    }

    /// Blurred by a Gaussian of a standard deviation in pixels.
    pub(crate) fn blurred(&self, sigma: f64) -> Self {
        let reach = (3.0 * sigma).ceil() as isize;
        let weight = |k: isize| (-0.5 * (k as f64 / sigma).powi(2)).exp() as f32;
        let sum: f32 = (-reach..=reach).map(weight).sum();
        let kernel: Vec<f32> = (-reach..=reach).map(|k| weight(k) / sum).collect();
        let along = |of: &Self, dx: isize, dy: isize| -> Vec<f32> {
            let pixel = |i: usize| {
                let (x, y) = ((i % of.width) as isize, (i / of.width) as isize);
                kernel.iter().zip(-reach..).map(|(w, k)| w * of.at(x + k * dx, y + k * dy)).sum()
            };
            (0..of.values.len()).into_par_iter().map(pixel).collect()
        };
        let rows = Self::new(self.width, self.height, along(self, 1, 0));
        Self::new(self.width, self.height, along(&rows, 0, 1))
    }
}
