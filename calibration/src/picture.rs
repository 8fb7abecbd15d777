//! Pictures of a board with known truth, for the tests.

use rayon::prelude::*;
use toile_geometry::{Rigid, camera::PinholeCamera};

use crate::{board::Board, grey::Grey};

/// Samples along each edge of a pixel.
const FINE: usize = 4;

/// The board at `camera_from_board` before grey, with noise (standard deviation of brightness 1.5 of 255).
pub(crate) fn picture(camera: &PinholeCamera, camera_from_board: &Rigid, board: &Board, seed: u64) -> Grey {
    let value = |x: f64, y: f64| {
        let (x, y) = (x / board.square_m + 1.0, y / board.square_m + 1.0);
        let inside = |m: f64| x > -m && y > -m && x < board.columns as f64 + 1.0 + m && y < board.rows as f64 + 1.0 + m;
        match (inside(0.0), inside(0.7)) {
            (true, _) => {
                if (x.floor() + y.floor()) as i64 % 2 == 0 {
                    30.0
                } else {
                    215.0
                }
            }
            (false, true) => 225.0,
            _ => 110.0,
        }
    };
    picture_of(camera, camera_from_board, seed, value)
}

/// A plane at `camera_from_plane` whose brightness at x, y (metres) is `bright`, seen with the same noise.
pub(crate) fn picture_of(
    camera: &PinholeCamera,
    camera_from_plane: &Rigid,
    seed: u64,
    bright: impl Fn(f64, f64) -> f64 + Sync,
) -> Grey {
    let (w, h) = (camera.width as usize, camera.height as usize);
    let plane_from_camera = camera_from_plane.inverse();
    let eye = plane_from_camera.translation.vector;
    let value = |u: f64, v: f64| {
        let ray = plane_from_camera.rotation * camera.unproject(u, v, 1.0).coords;
        let at = eye - ray * (eye.z / ray.z);
        bright(at.x, at.y)
    };
    let pixel = |i: usize| {
        let (x, y) = ((i % w) as f64, (i / w) as f64);
        let offset = |k: usize| (k as f64 + 0.5) / FINE as f64 - 0.5;
        let sum: f64 = (0..FINE * FINE).map(|k| value(x + offset(k % FINE), y + offset(k / FINE))).sum();
        (sum / (FINE * FINE) as f64 + 1.5 * normal(seed << 32 | i as u64)).round().clamp(0.0, 255.0) as f32
    };
    // A lens blurs by about half a pixel.
    Grey::new(w, h, (0..w * h).into_par_iter().map(pixel).collect()).blurred(0.6)
}

/// About a normal number from a counter: the sum of twelve uniform ones.
pub(crate) fn normal(counter: u64) -> f64 {
    let uniform = |k: u64| {
        let mut x = (counter * 12 + k).wrapping_add(0x9e37_79b9_7f4a_7c15);
        x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ x >> 31) >> 11) as f64 / (1u64 << 53) as f64
    };
    (0..12).map(uniform).sum::<f64>() - 6.0
}
