//! Triangles of the atlas to texels.

use std::ops::Range;

use rayon::prelude::*;

use crate::atlas::{Atlas, area};

/// Texels closer than this to an edge, texels, may belong to both sides: rounding puts them there.
const EDGE: f32 = 0.02;
/// Rows that one task works on.
pub(crate) const BAND: usize = 32;
/// How far outside of a triangle a texel's middle may lie and still be its, texels: rounding must leave no gap.
const SLACK: f32 = 1e-3;

/// A triangle ready to be drawn: barycentric coordinates are linear in the texel.
pub(crate) struct Setup {
    /// Rows that it touches.
    rows: Range<usize>,
    columns: Range<usize>,
    /// Value at the texel with index 0, step along x, step along y, of each coordinate.
    weights: [[f32; 3]; 3],
    /// How far each coordinate may be below 0.
    slack: [f32; 3],
}

impl Setup {
    /// `None` for a triangle without area. Texels up to `slack` outside of it count.
    pub(crate) fn new(corners: [[f32; 2]; 3], size: usize, slack: f32) -> Option<Self> {
        let double = f64::from(area(corners)) * 2.0;
        if double.abs() < 1e-7 {
            return None;
        }
        let range = |k: usize| {
            let (lo, hi) = corners.iter().fold((f32::MAX, f32::MIN), |(lo, hi), c| (lo.min(c[k]), hi.max(c[k])));
            let first = (lo - 0.5 - slack).ceil().max(0.0) as usize;
            first..((hi - 0.5 + slack).floor() + 1.0).clamp(0.0, size as f32) as usize
        };
        let (mut weights, mut allowed) = ([[0.0; 3]; 3], [0.0; 3]);
        for k in 0..3 {
            let (p, q) = (corners[(k + 1) % 3].map(f64::from), corners[(k + 2) % 3].map(f64::from));
            let (dx, dy) = ((p[1] - q[1]) / double, (q[0] - p[0]) / double);
            let start = -((p[0] - 0.5) * dx + (p[1] - 0.5) * dy);
            weights[k] = [start as f32, dx as f32, dy as f32];
            allowed[k] = slack * (dx * dx + dy * dy).sqrt() as f32;
        }
        Some(Self { rows: range(1), columns: range(0), weights, slack: allowed })
    }

    /// Calls `draw(column, row, barycentric)` for its texels in `rows`.
    pub(crate) fn draw(&self, rows: &Range<usize>, mut draw: impl FnMut(usize, usize, [f32; 3])) {
        for y in self.rows.start.max(rows.start)..self.rows.end.min(rows.end) {
            for x in self.columns.clone() {
                let w = self.weights.map(|[start, dx, dy]| start + dx * x as f32 + dy * y as f32);
                if (0..3).all(|k| w[k] >= -self.slack[k]) {
                    draw(x, y, w);
                }
            }
        }
    }
}

/// Triangles of the atlas that touch each band of rows, in their order; `slack` as in [`Setup::new`].
pub(crate) fn bands(atlas: &Atlas, slack: f32) -> Vec<Vec<u32>> {
    let size = atlas.size as usize;
    let mut bands = vec![Vec::new(); size.div_ceil(BAND)];
    for t in 0..atlas.triangles.len() {
        let rows = atlas.texels(t).map(|c| c[1]);
        let (lo, hi) = rows.iter().fold((f32::MAX, f32::MIN), |(lo, hi), r| (lo.min(*r), hi.max(*r)));
        let first = (lo - 0.5 - slack).ceil().max(0.0) as usize;
        let end = ((hi - 0.5 + slack).floor() + 1.0).clamp(0.0, size as f32) as usize;
        if first < end {
            bands[first / BAND..=(end - 1) / BAND].iter_mut().for_each(|band| band.push(t as u32));
        }
    }
    bands
}

/// Triangles that cover a texel's middle which another triangle, drawn before, covers too; a middle on a shared edge is nobody's.
pub(crate) fn folded(atlas: &Atlas) -> Vec<u32> {
    let size = atlas.size as usize;
    let find = |(band, triangles): (usize, Vec<u32>)| {
        let rows = band * BAND..((band + 1) * BAND).min(size);
        let mut is_taken = vec![false; rows.len() * size];
        let mut folded = Vec::new();
        for t in triangles {
            if let Some(setup) = Setup::new(atlas.texels(t as usize), size, -EDGE) {
                let mut is_over = false;
                setup.draw(&rows, |x, y, _| {
                    is_over |= std::mem::replace(&mut is_taken[(y - rows.start) * size + x], true);
                });
                if is_over {
                    folded.push(t);
                }
            }
        }
        folded
    };
    let parts: Vec<Vec<u32>> = bands(atlas, 0.0).into_par_iter().enumerate().map(find).collect();
    parts.concat()
}

/// Draws all triangles: `pixels` has `size` rows of `size`; `draw(triangle, barycentric, pixel)` is called for the texels of
/// each, bands of rows in parallel.
pub(crate) fn draw<T: Send, S>(
    atlas: &Atlas,
    pixels: &mut [T],
    prepare: impl Fn(usize) -> S + Sync,
    draw: impl Fn(&S, [f32; 3], &mut T) + Sync,
) {
    let size = atlas.size as usize;
    let bands = bands(atlas, SLACK);
    pixels.par_chunks_mut(BAND * size).zip(bands).enumerate().for_each(|(band, (cells, triangles))| {
        let rows = band * BAND..((band + 1) * BAND).min(size);
        for t in triangles {
            if let Some(setup) = Setup::new(atlas.texels(t as usize), size, SLACK) {
                let prepared = prepare(t as usize);
                setup.draw(&rows, |x, y, w| draw(&prepared, w, &mut cells[(y - rows.start) * size + x]));
            }
        }
    });
}
