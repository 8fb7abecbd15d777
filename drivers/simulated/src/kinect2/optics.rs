//! The calibration of the modelled camera: as truth in metres, and as the numbers that the camera states.

use nalgebra::{Translation3, UnitQuaternion, Vector3};
use toile_geometry::{Rigid, camera::PinholeCamera};

use super::{COLOR_SIZE, IMAGE_BYTES, SIZE};

/// Units of the stated polynomials (libfreenect2 `src/registration.cpp`).
const DEPTH_UNIT: f64 = 0.01;
const COLOR_UNIT: f64 = 0.002199;
/// Distance at which the stated polynomials hold, millimetres.
const SHIFT_D: f64 = 863.0;
/// First column of the stated tables P0 (libfreenect2 `protocol/response.h`).
const P0: [u16; 3] = [0x2c9a, 0x08ec, 0x42e8];

/// True optics of one camera, not mirrored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Optics {
    /// The depth camera.
    pub depth: PinholeCamera,
    /// The colour camera; its two focal lengths are equal.
    pub color: PinholeCamera,
    /// How far the colour camera is turned about +Z, radians.
    pub roll: f64,
    /// Colour camera's place along its +X, metres.
    pub baseline: f64,
}

impl Default for Optics {
    /// A lens that bends, as real ones do.
    fn default() -> Self {
        let mut optics = Self::of_synthetic_sensor();
        optics.depth = PinholeCamera::ideal(512, 424, 365.7, 365.7, 251.3, 205.9);
        optics.depth.distortion = [0.092, -0.271, 0.0, 0.0, 0.096];
        optics.color.cx = 953.2;
        optics.roll = 0.004;
        optics
    }
}

impl Optics {
    /// The optics of the synthetic sensor: its depth camera, and a colour camera beside it.
    pub fn of_synthetic_sensor() -> Self {
        Self {
            depth: PinholeCamera::ideal(512, 424, 365.0, 365.0, 256.0, 212.0),
            color: PinholeCamera::ideal(COLOR_SIZE.0 as u32, COLOR_SIZE.1 as u32, 1081.4, 1081.4, 959.5, 539.5),
            roll: 0.0,
            baseline: 0.052,
        }
    }

    /// Where the depth camera stands in the colour camera's frame.
    pub fn color_from_depth(&self) -> Rigid {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.roll);
        Rigid::from_parts(Translation3::new(-self.baseline, 0.0, 0.0), turn)
    }

    /// Where the colour camera sees what depth pixel (`u`, `v`) has at `z` metres.
    pub fn color_pixel(&self, u: f64, v: f64, z: f64) -> Option<[f64; 2]> {
        let place = self.color_from_depth() * self.depth.unproject(u, v, z);
        self.color.project(&place).map(|p| [p.x, p.y])
    }

    /// P0 of frequency `f` at column and row of the stated (mirrored) table.
    pub fn p0(f: usize, column: usize, row: usize) -> u16 {
        P0[f] + ((column * 7 + row * 5 + f * 40) % 1300) as u16
    }

    /// The answers with the depth camera's numbers, the colour camera's, and the tables P0.
    pub fn answers(&self) -> [Vec<u8>; 3] {
        [self.stated_depth(), self.stated_color(), Self::stated_p0()]
    }

    /// The answer with the depth camera's numbers.
    pub(super) fn stated_depth(&self) -> Vec<u8> {
        let lens = &self.depth;
        let [k1, k2, p1, p2, k3] = lens.distortion;
        // Mirrored, pixel centres at halves.
        let center = [SIZE.0 as f64 - (lens.cx + 0.5), lens.cy + 0.5];
        let mut stated = vec![lens.fx, lens.fy, 0.0, center[0], center[1], k1, k2, p1, -p2, k3];
        stated.resize(23, 0.0);
        floats(&stated)
    }

    /// The answer with the colour camera's numbers and the way from depth to it.
    pub(super) fn stated_color(&self) -> Vec<u8> {
        let (depth, color, shift_m) = (&self.depth, &self.color, 1000.0 * self.baseline);
        let (sin, cos) = self.roll.sin_cos();
        let unit = COLOR_UNIT * color.fx;
        // A stated place is (pixel − centre) / 100 of the mirrored image with pixel centres at integers, half a pixel less
        // than the ray says.
        let slope = [1.0 / (DEPTH_UNIT * depth.fx), 1.0 / (DEPTH_UNIT * depth.fy)];
        let half = [0.5 / depth.fx, 0.5 / depth.fy];
        let mut column = [0.0; 10];
        column[7] = unit * cos * slope[0];
        column[8] = unit * sin * slope[1];
        column[9] = unit * (shift_m / SHIFT_D + cos * half[0] + sin * half[1]);
        let mut row = [0.0; 10];
        row[7] = -unit * sin * slope[0];
        row[8] = unit * cos * slope[1];
        row[9] = unit * (cos * half[1] - sin * half[0]);
        let camera = [color.fx, (COLOR_SIZE.0 - 1) as f64 - color.cx, color.cy, SHIFT_D, shift_m];
        let mut stated = vec![1];
        stated.extend(floats(&[&camera[..], &column, &row].concat()));
        stated.resize(1 + 4 * (25 + 28 * 23 * 5), 0);
        stated
    }

    /// The answer with the tables P0.
    pub(super) fn stated_p0() -> Vec<u8> {
        let pixels = SIZE.0 * SIZE.1;
        let mut stated = Vec::with_capacity(IMAGE_BYTES * 5);
        stated.extend([32, 0, 0, 2 * pixels as u32, 0, 0, 0, 0].iter().flat_map(|w: &u32| w.to_le_bytes()));
        for f in 0..3 {
            stated.extend([0, 0]);
            stated.extend((0..pixels).flat_map(|i| Self::p0(f, i % SIZE.0, i / SIZE.0).to_le_bytes()));
            stated.extend([0, 0]);
        }
        stated
    }
}

fn floats(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|&value| (value as f32).to_le_bytes()).collect()
}
