//! Depth as the colour camera sees it, by the device's own polynomials; and the cameras that fit them.
//!
//! The device's rule (libfreenect `src/registration.c`): a depth pixel (u, v) at z goes to column
//! ⌊u + dx(u, v) + 1 + s·(z − r) / z + 0.375⌋ and row ⌊v + dy(u, v) + 1⌋ less the padding, with r the zero plane's
//! distance and s the distance of the cameras in pixels of the zero plane. A whole number n there is the pixel from n to
//! n + 1; with pixel centres at integers the point is half a pixel less.

use toile_geometry::{Rigid, camera::PinholeCamera};

use crate::{
    Calibration,
    calibration::{MAX_MM, OFFSET},
    decode::{HEIGHT, WIDTH},
};

/// Columns and rows are one further (libfreenect `DEPTH_X_OFFSET`, `DEPTH_Y_OFFSET`).
const ONE: f64 = 1.0;
/// Fixed point of the tables (libfreenect `freenect_create_dxdy_tables`).
const UNIT: f64 = (1 << 17) as f64;

/// Where each depth pixel goes.
#[derive(Debug, Clone, PartialEq)]
pub struct Registration {
    /// Column and row of each pixel at an infinite distance, pixel centres at integers.
    far: Vec<[f32; 2]>,
    /// Columns that a pixel at one metre goes to the left of that.
    shift: f64,
    focal: f64,
}

impl Registration {
    /// The tables of a calibration.
    pub fn new(calibration: &Calibration) -> Self {
        // Centimetres on the zero plane to depth pixels; r is in centimetres too.
        let pixels = calibration.color_cm / (2.0 * calibration.pixel);
        let bias = ONE - 0.5;
        let far = polynomials(&calibration.registration)
            .into_iter()
            .enumerate()
            .map(|(i, [dx, dy])| {
                let (u, v) = ((i % WIDTH) as f64, (i / WIDTH) as f64);
                let row = v + dy + bias - f64::from(calibration.start_lines);
                [(u + dx + bias + OFFSET + pixels) as f32, row as f32]
            })
            .collect();
        Self { far, shift: pixels * calibration.reference * 0.01, focal: calibration.focal_length() }
    }

    /// Where the colour camera sees depth pixel (`u`, `v`) that is `mm` away; pixel centres at integers.
    pub fn color_pixel(&self, u: usize, v: usize, mm: u16) -> [f64; 2] {
        let [x, y] = self.far[v * WIDTH + u];
        [f64::from(x) - self.shift / (1e-3 * f64::from(mm.max(1))), f64::from(y)]
    }

    /// Depth in millimetres as the colour camera sees it: each pixel where the colour camera has it, the nearest where
    /// several meet; 0 where there is none.
    pub fn register(&self, depth_mm: &[u16]) -> Vec<u16> {
        let mut out = vec![0; WIDTH * HEIGHT];
        for (i, &mm) in depth_mm.iter().enumerate().take(WIDTH * HEIGHT) {
            if mm == 0 || mm > MAX_MM {
                continue;
            }
            let [x, y] = self.color_pixel(i % WIDTH, i / WIDTH, mm).map(f64::round);
            if (0.0..WIDTH as f64).contains(&x) && (0.0..HEIGHT as f64).contains(&y) {
                let cell = &mut out[y as usize * WIDTH + x as usize];
                if *cell == 0 || mm < *cell {
                    *cell = mm;
                }
            }
        }
        out
    }

    /// The depth camera: the camera does not state its centre, so the image's.
    pub fn depth_camera(&self) -> PinholeCamera {
        let (cx, cy) = ((WIDTH - 1) as f64 / 2.0, (HEIGHT - 1) as f64 / 2.0);
        PinholeCamera::ideal(WIDTH as u32, HEIGHT as u32, self.focal, self.focal, cx, cy)
    }

    /// The colour camera that fits the tables best (least squares over all pixels, without distortion), and where the
    /// depth camera stands in its frame.
    pub fn color_camera(&self) -> (PinholeCamera, Rigid) {
        let depth = self.depth_camera();
        let (scale_x, at_x) = line(self.far.iter().enumerate().map(|(i, p)| ((i % WIDTH) as f64, f64::from(p[0]))));
        let (scale_y, at_y) = line(self.far.iter().enumerate().map(|(i, p)| ((i / WIDTH) as f64, f64::from(p[1]))));
        let (fx, fy) = (scale_x * depth.fx, scale_y * depth.fy);
        let (cx, cy) = (at_x + scale_x * depth.cx, at_y + scale_y * depth.cy);
        let camera = PinholeCamera::ideal(WIDTH as u32, HEIGHT as u32, fx, fy, cx, cy);
        (camera, Rigid::translation(-self.shift / fx, 0.0, 0.0))
    }
}

/// Slope and start of the line through points, least squares.
fn line(points: impl Iterator<Item = (f64, f64)>) -> (f64, f64) {
    let (mut n, mut x, mut y, mut xx, mut xy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (px, py) in points {
        (n, x, y, xx, xy) = (n + 1.0, x + px, y + py, xx + px * px, xy + px * py);
    }
    let slope = (n * xy - x * y) / (n * xx - x * x);
    (slope, (y - slope * x) / n)
}

/// dx and dy of every pixel by third-order differences in fixed point, as the device means them (libfreenect
/// `freenect_create_dxdy_tables`; the shifts clamp to 32 bits on purpose).
fn polynomials(stated: &[i32; 29]) -> Vec<[f64; 2]> {
    let start = |i: usize| i64::from((stated[i] << 13) >> 4);
    let first = |i: usize| i64::from((stated[i] << 11) >> 3);
    let second = |i: usize| i64::from((stated[i] << 5) << 3);
    let third = |i: usize| i64::from(stated[i]);
    // Value, its change along a column step and that change's change; the same three changed by a row step.
    let mut x = Row {
        value: start(5),
        by_row: [first(19), second(26), third(2)],
        by_column: [first(17), second(21), third(3)],
        mixed: [second(22), third(4)],
        last: third(1),
    };
    let mut y = Row {
        value: start(10),
        by_row: [first(20), second(28), third(7)],
        by_column: [first(18), second(23), third(8)],
        mixed: [second(24), third(9)],
        last: third(6),
    };
    let mut table = Vec::with_capacity(WIDTH * HEIGHT);
    for _ in 0..HEIGHT {
        x.step();
        y.step();
        table.extend(x.columns().zip(y.columns()).map(|(dx, dy)| [dx as f64 / UNIT, dy as f64 / UNIT]));
    }
    table
}

/// One of the two polynomials at the beginning of a row.
struct Row {
    value: i64,
    /// Change of the value by a row, that change's change, and its.
    by_row: [i64; 3],
    /// Change by a column, its change by a column, and the change of that by a row.
    by_column: [i64; 3],
    /// Change of the first column change by a row, and its change by a row.
    mixed: [i64; 2],
    /// Change of the second column change by a column.
    last: i64,
}

impl Row {
    fn step(&mut self) {
        self.by_column[1] += self.by_column[2];
        self.by_column[0] += self.mixed[0] >> 8;
        self.mixed[0] += self.mixed[1];
        self.value += self.by_row[0] >> 6;
        self.by_row[0] += self.by_row[1] >> 8;
        self.by_row[1] += self.by_row[2];
    }

    fn columns(&self) -> impl Iterator<Item = i64> {
        let (mut value, [mut first, mut second, _], last) = (self.value, self.by_column, self.last);
        (0..WIDTH).map(move |_| {
            let here = value;
            value += first >> 6;
            first += second >> 8;
            second += last;
            here
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn calibration(registration: [i32; 29]) -> Calibration {
        Calibration {
            emitter_cm: 7.5,
            color_cm: 2.4,
            reference: 120.0,
            pixel: 0.1042,
            const_shift: 200.0,
            registration,
            start_lines: 0,
        }
    }

    #[test]
    fn without_polynomials_only_the_distance_shifts() {
        let registration = Registration::new(&calibration([0; 29]));
        // At the zero plane: 1 + 0.375 - 0.5.
        let [x, y] = registration.color_pixel(100, 50, 1200);
        assert!((x - 100.875).abs() < 1e-4 && (y - 50.5).abs() < 1e-6, "{x} {y}");
        assert!(registration.color_pixel(100, 50, 600)[0] < x - 11.0);
    }

    #[test]
    fn the_nearest_wins_and_nothing_leaves_the_image() {
        let registration = Registration::new(&calibration([0; 29]));
        let mut depth = vec![0; WIDTH * HEIGHT];
        depth[0] = 500;
        depth[639] = 9999;
        // At 800 and 2400 mm the shifts differ by a whole number plus a bit: two pixels of one row that meet.
        let far = registration.color_pixel(300, 10, 2400)[0].round() as usize;
        let near = (300..400).find(|&u| registration.color_pixel(u, 10, 800)[0].round() as usize == far).unwrap();
        depth[10 * WIDTH + 300] = 2400;
        depth[10 * WIDTH + near] = 800;
        let out = registration.register(&depth);
        assert_eq!(out.iter().filter(|mm| **mm > 0).count(), 1);
        assert_eq!(out.iter().copied().max(), Some(800));
    }
}
