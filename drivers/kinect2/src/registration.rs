//! Colour as the depth camera sees it, by the device's own polynomials; and the colour camera that fits them.
//!
//! The device's rule (libfreenect2 `src/registration.c`, `depth_to_color` and `apply`; learnt in its issue #41): with the
//! depth pixel's distance from the centre in hundreds of pixels, without the lens' distortion, two cubic polynomials give
//! the column at distance `shift_d` and the row; the column then moves by the parallax between `shift_d` and the pixel's
//! own depth. All of it is stated for mirrored images; here images are not mirrored.

use nalgebra::{UnitQuaternion, Vector3};
use toile_capture::RgbImage;
use toile_geometry::{Rigid, camera::PinholeCamera};

use crate::{
    Calibration,
    color::{COLOR_COLUMNS, COLOR_ROWS},
    size::{COLUMNS, ROWS},
};

/// Units of the polynomials (libfreenect2 `depth_q`, `color_q`).
const DEPTH_UNIT: f64 = 0.01;
const COLOR_UNIT: f64 = 0.002199;
/// The nearest depths before the colour camera are kept in cells of this many of its columns and rows: about a depth pixel.
const CELL: usize = 3;
const CELLS: [usize; 2] = [COLOR_COLUMNS.div_ceil(CELL), COLOR_ROWS.div_ceil(CELL)];
/// A pixel is hidden where something is nearer by this share of its depth; pixels nearer together are of one surface.
const BEHIND: f32 = 0.03;
/// The colour of a hidden pixel is looked for this many pixels aside.
const ASIDE: usize = 24;
/// Pixels without depth get the colour that they would have at this distance, millimetres.
const NO_DEPTH_MM: f32 = 2000.0;

/// Where each depth pixel is in colour.
#[derive(Debug, Clone, PartialEq)]
pub struct Registration {
    /// Column and row of each pixel at an infinite distance, pixel centres at integers.
    far: Vec<[f32; 2]>,
    /// Columns that a pixel at one millimetre goes to the left of that.
    shift: f32,
    depth: PinholeCamera,
}

impl Registration {
    /// The tables of a calibration.
    pub fn new(calibration: &Calibration) -> Self {
        let (depth, color) = (calibration.depth, &calibration.color);
        let far = depth.rays().into_iter().map(|ray| {
            let [x, y] = ray.map(f64::from);
            // As if without distortion, mirrored, from the stated centre; pixel centres at integers.
            let from_center = [-x * depth.fx - 0.5, y * depth.fy - 0.5].map(|d| d * DEPTH_UNIT);
            let [wx, wy] = color.polynomials.each_ref().map(|p| polynomial(p, from_center));
            let column = wx / COLOR_UNIT - color.focal * color.shift_m / color.shift_d + color.center[0];
            let row = wy / COLOR_UNIT + color.center[1];
            [((COLOR_COLUMNS - 1) as f64 - column) as f32, row as f32]
        });
        Self { far: far.collect(), shift: (color.focal * color.shift_m) as f32, depth }
    }

    /// Where the colour camera sees depth pixel (`u`, `v`) that is `mm` away, not mirrored, pixel centres at integers.
    pub fn color_pixel(&self, u: usize, v: usize, mm: f32) -> [f32; 2] {
        let [x, y] = self.far[v * COLUMNS + u];
        [x - self.shift / mm, y]
    }

    /// The colour of each depth pixel, of mirrored colours as [`crate::color::decode`] gives them: mixed of the four
    /// pixels around its place; black where the colour camera does not look. A pixel that something nearer hides from
    /// the colour camera gets the colour of the next one in its row that is of the same surface and seen. Depth is in
    /// millimetres, 0 where there is none.
    pub fn register(&self, depth_mm: &[f32], mirrored: &[[u8; 3]]) -> RgbImage {
        let nearest = self.nearest(depth_mm);
        let place = |(&mm, far): (&f32, &[f32; 2])| {
            let mm = if mm > 0.0 { mm } else { NO_DEPTH_MM };
            [far[0] - self.shift / mm, far[1]]
        };
        let places: Vec<[f32; 2]> = depth_mm.iter().zip(&self.far).map(place).collect();
        let is_hidden = |(&mm, at): (&f32, &[f32; 2])| cell(*at).is_some_and(|i| nearest[i] < mm * (1.0 - BEHIND));
        let hidden: Vec<bool> = depth_mm.iter().zip(&places).map(is_hidden).collect();
        let seen = |[x, y]: &[f32; 2]| mixed(mirrored, (COLOR_COLUMNS - 1) as f32 - x, *y);
        let mut pixels: Vec<[u8; 3]> = places.iter().map(seen).collect();
        for i in (0..pixels.len()).filter(|i| hidden[*i]) {
            pixels[i] = beside(i, depth_mm, &hidden).map_or([0; 3], |j| pixels[j]);
        }
        RgbImage { width: COLUMNS as u32, height: ROWS as u32, pixels }
    }

    /// The smallest depth in each cell of the colour image, millimetres: every pixel covers the cells that it touches.
    fn nearest(&self, depth_mm: &[f32]) -> Vec<f32> {
        let mut nearest = vec![f32::INFINITY; CELLS[0] * CELLS[1]];
        // Half a depth pixel, and as far as pixels are mixed.
        let half = 0.5 * CELL as f32 + 1.0;
        for (&mm, far) in depth_mm.iter().zip(&self.far).filter(|(mm, _)| **mm > 0.0) {
            let [x, y] = [far[0] - self.shift / mm, far[1]];
            for (x, y) in [x - half, x, x + half].into_iter().flat_map(|x| [(x, y - half), (x, y), (x, y + half)]) {
                if let Some(i) = cell([x, y]) {
                    nearest[i] = nearest[i].min(mm);
                }
            }
        }
        nearest
    }

    /// The colour camera that fits the tables best (least squares over all pixels, without distortion), and where the
    /// depth camera stands in its frame.
    pub fn color_camera(&self) -> (PinholeCamera, Rigid) {
        let rays = self.depth.rays();
        let fit =
            |k: usize| plane(rays.iter().zip(&self.far).map(|(ray, far)| (ray.map(f64::from), f64::from(far[k]))));
        let ([ax, ay, a], [bx, by, b]) = (fit(0), fit(1));
        let focal = (ax * by - ay * bx).abs().sqrt();
        let roll = (bx - ay).atan2(ax + by);
        let camera = PinholeCamera::ideal(COLOR_COLUMNS as u32, COLOR_ROWS as u32, focal, focal, a, b);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), roll);
        let place = Vector3::new(-f64::from(self.shift) * 1e-3 / focal, 0.0, 0.0);
        (camera, Rigid::from_parts(place.into(), turn))
    }
}

/// x³, y³, x²y, xy², x², y², xy, x, y, 1.
fn polynomial(p: &[f64; 10], [x, y]: [f64; 2]) -> f64 {
    let terms = [x * x * x, y * y * y, x * x * y, x * y * y, x * x, y * y, x * y, x, y, 1.0];
    p.iter().zip(terms).map(|(p, t)| p * t).sum()
}

/// The cell of a place in the colour image; `None` outside.
#[inline]
fn cell([x, y]: [f32; 2]) -> Option<usize> {
    // NaN is not within.
    let inside = x >= 0.0 && y >= 0.0 && x < COLOR_COLUMNS as f32 && y < COLOR_ROWS as f32;
    inside.then(|| y as usize / CELL * CELLS[0] + x as usize / CELL)
}

/// The nearest pixel in the same row that is of the same surface and not hidden.
fn beside(i: usize, depth_mm: &[f32], hidden: &[bool]) -> Option<usize> {
    let row = i - i % COLUMNS..i - i % COLUMNS + COLUMNS;
    let sides = (1..=ASIDE).flat_map(|k| [i.wrapping_sub(k), i + k]);
    let like = |j: &usize| !hidden[*j] && (depth_mm[*j] - depth_mm[i]).abs() < BEHIND * depth_mm[i];
    sides.filter(|j| row.contains(j)).find(like)
}

/// Mix of the four pixels around a place; black outside.
#[inline]
fn mixed(pixels: &[[u8; 3]], x: f32, y: f32) -> [u8; 3] {
    // NaN is not within.
    if !(x >= 0.0 && y >= 0.0 && x <= (COLOR_COLUMNS - 1) as f32 && y <= (COLOR_ROWS - 1) as f32) {
        return [0; 3];
    }
    let (left, top) = ((x as usize).min(COLOR_COLUMNS - 2), (y as usize).min(COLOR_ROWS - 2));
    // In 1/256: the mix is then exact in whole numbers.
    let (right, down) = (((x - left as f32) * 256.0) as u32, ((y - top as f32) * 256.0) as u32);
    let i = top * COLOR_COLUMNS + left;
    let (a, b) = (&pixels[i..i + 2], &pixels[i + COLOR_COLUMNS..i + COLOR_COLUMNS + 2]);
    let mix = |k: usize| {
        let upper = u32::from(a[0][k]) * (256 - right) + u32::from(a[1][k]) * right;
        let lower = u32::from(b[0][k]) * (256 - right) + u32::from(b[1][k]) * right;
        ((upper * (256 - down) + lower * down + (1 << 15)) >> 16) as u8
    };
    [mix(0), mix(1), mix(2)]
}

/// The plane p·x + q·y + r through points, least squares.
fn plane(points: impl Iterator<Item = ([f64; 2], f64)>) -> [f64; 3] {
    let (mut normal, mut right) = (nalgebra::Matrix3::zeros(), Vector3::zeros());
    for ([x, y], value) in points {
        let row = Vector3::new(x, y, 1.0);
        normal += row * row.transpose();
        right += row * value;
    }
    // The rays of a camera are never all on one line.
    normal.try_inverse().map_or([0.0; 3], |inverse| (inverse * right).into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_mixed_and_black_outside() {
        let mut pixels = vec![[10, 20, 30]; COLOR_COLUMNS * COLOR_ROWS];
        pixels[5 * COLOR_COLUMNS + 7] = [110, 20, 30];
        assert_eq!(mixed(&pixels, 7.0, 5.0), [110, 20, 30]);
        assert_eq!(mixed(&pixels, 6.5, 5.0), [60, 20, 30]);
        assert_eq!(mixed(&pixels, 7.0, 4.25), [35, 20, 30]);
        assert_eq!(mixed(&pixels, 1919.0, 1079.0), [10, 20, 30]);
        for (x, y) in [(-0.1, 4.0), (3.0, 1079.5), (1919.2, 0.0), (f32::NAN, 0.0)] {
            assert_eq!(mixed(&pixels, x, y), [0; 3]);
        }
    }

    #[test]
    fn a_plane_through_its_points() {
        let points = (0..20).map(|i| [f64::from(i % 5), f64::from(i / 5)]);
        let [p, q, r] = plane(points.map(|[x, y]| ([x, y], 3.0 * x - 2.0 * y + 0.5)));
        assert!((p - 3.0).abs() < 1e-9 && (q + 2.0).abs() < 1e-9 && (r - 0.5).abs() < 1e-9);
    }
}
