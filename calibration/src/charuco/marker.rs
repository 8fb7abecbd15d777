//! The black and white squares of a marker between four corners of a board.

use nalgebra::Point2;

use crate::{
    grey::Grey,
    homography::{homography, mapped},
};

/// White and black differ by this share of white at least: what a bad light leaves.
const CONTRAST: f64 = 0.25;
/// Squares of the black border that may look white.
const BORDER_WRONG: usize = 1;
/// Samples lie this far from the middle of a square, as a share of its edge.
const ASIDE: f64 = 0.2;

/// Reads `n` by `n` squares of the marker whose black border fills `share` of the edge of the white square between four corners
/// (clockwise from its top left): row by row, white is 1. `None` where there is no marker.
pub(super) fn read(picture: &Grey, corners: &[Point2<f64>; 4], share: f64, n: usize) -> Option<u64> {
    let unit = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| Point2::new(x, y));
    let map = homography(&unit, corners)?;
    let bright = |x: f64, y: f64| {
        let p = mapped(&map, &Point2::new(x, y));
        picture.sample(p.x, p.y)
    };
    let margin = 0.5 * (1.0 - share);
    let edge = share / (n + 2) as f64;
    let square = |row: usize, column: usize| {
        let (x, y) = (margin + edge * (column as f64 + 0.5), margin + edge * (row as f64 + 0.5));
        let around = [(0.0, 0.0), (-ASIDE, -ASIDE), (ASIDE, -ASIDE), (-ASIDE, ASIDE), (ASIDE, ASIDE)];
        around.iter().map(|(a, b)| bright(x + a * edge, y + b * edge)).sum::<f64>() / 5.0
    };
    let white = [0.2, 0.5, 0.8].iter().flat_map(|&s| {
        let near = 0.5 * margin;
        [bright(s, near), bright(s, 1.0 - near), bright(near, s), bright(1.0 - near, s)]
    });
    let white = white.sum::<f64>() / 12.0;
    let is_border = |k: &usize| [0, n + 1].contains(&(k / (n + 2))) || [0, n + 1].contains(&(k % (n + 2)));
    let border: Vec<f64> = (0..(n + 2) * (n + 2)).filter(is_border).map(|k| square(k / (n + 2), k % (n + 2))).collect();
    let black = border.iter().sum::<f64>() / border.len() as f64;
    let middle = 0.5 * (white + black);
    let wrong = border.iter().filter(|value| **value > middle).count();
    if white - black < CONTRAST * white || wrong > BORDER_WRONG {
        return None;
    }
    Some((0..n * n).fold(0, |code, k| code << 1 | u64::from(square(1 + k / n, 1 + k % n) > middle)))
}
