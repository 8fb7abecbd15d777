//! Corners of a chessboard are saddles of brightness: bright along one diagonal, dark along the other.

use nalgebra::{Matrix2, Point2, Vector2};
use rayon::prelude::*;

use crate::grey::Grey;

/// A saddle is the strongest within this many pixels.
const REACH: isize = 3;
/// Its strength is at least this share of the strongest one's: what shade leaves of a corner.
const WEAKEST: f32 = 0.01;
/// Saddles that are kept at most, strongest first.
const MOST: usize = 3000;
/// Rounds of the refinement, and the change at which it ends, pixels.
const ROUNDS: usize = 20;
const STILL: f64 = 1e-4;

/// A crossing of two edges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Saddle {
    pub at: Point2<f64>,
    /// Unit directions of the two edges; from the first to the second one (turned by less than a half turn, x towards y) it is
    /// dark.
    pub edges: [Vector2<f64>; 2],
}

/// The saddles of a picture that was blurred by `sigma` pixels, strongest first.
pub(crate) fn find_saddles(picture: &Grey, sigma: f64) -> Vec<Saddle> {
    let smooth = picture.blurred(sigma);
    let (w, h) = (smooth.width as isize, smooth.height as isize);
    let strength = |i: usize| {
        let [xx, xy, yy] = hessian(&smooth, i as isize % w, i as isize / w);
        xy * xy - xx * yy
    };
    let all: Vec<f32> = (0..smooth.values.len()).into_par_iter().map(strength).collect();
    let least = WEAKEST * all.iter().copied().fold(0.0, f32::max);
    let is_peak = |&(x, y): &(isize, isize)| {
        let value = all[(y * w + x) as usize];
        let others = (-REACH..=REACH).flat_map(|dy| (-REACH..=REACH).map(move |dx| (dx, dy)));
        value > least && others.filter(|d| *d != (0, 0)).all(|(dx, dy)| all[((y + dy) * w + x + dx) as usize] < value)
    };
    let inside = (REACH + 1..h - REACH - 1).flat_map(|y| (REACH + 1..w - REACH - 1).map(move |x| (x, y)));
    let mut peaks: Vec<(isize, isize)> = inside.filter(is_peak).collect();
    peaks.sort_by(|a, b| all[(b.1 * w + b.0) as usize].total_cmp(&all[(a.1 * w + a.0) as usize]));
    peaks.truncate(MOST);
    peaks.into_iter().filter_map(|(x, y)| saddle_at(&smooth, x, y)).collect()
}

fn hessian(g: &Grey, x: isize, y: isize) -> [f32; 3] {
    let c = 2.0 * g.at(x, y);
    let xy = g.at(x + 1, y + 1) + g.at(x - 1, y - 1) - g.at(x - 1, y + 1) - g.at(x + 1, y - 1);
    [g.at(x + 1, y) + g.at(x - 1, y) - c, 0.25 * xy, g.at(x, y + 1) + g.at(x, y - 1) - c]
}

/// Position and edges from the second derivatives, to be refined.
fn saddle_at(g: &Grey, x: isize, y: isize) -> Option<Saddle> {
    let [xx, xy, yy] = hessian(g, x, y).map(f64::from);
    let slope = Vector2::new(g.at(x + 1, y) - g.at(x - 1, y), g.at(x, y + 1) - g.at(x, y - 1)).cast::<f64>() * 0.5;
    let shift = -(Matrix2::new(xx, xy, xy, yy).try_inverse()? * slope);
    if shift.norm() > 1.5 {
        return None;
    }
    // Brightness is level along the edges: xx c² + 2 xy c s + yy s² = 0. Between the eigenvectors e (dark, positive
    // curvature) and f (bright) they lie at the angle whose tangent is √(−λe / λf).
    let mean = 0.5 * (xx + yy);
    let half = (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt();
    let (brightest, darkest) = (mean + half, mean - half);
    if brightest <= 0.0 || darkest >= 0.0 {
        return None;
    }
    let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
    // Along the angle of the eigenvector of the larger eigenvalue brightness is a valley's: dark in the middle, brighter
    // outwards. So the dark quadrants lie across it.
    let spread = (brightest / -darkest).sqrt().atan();
    let direction = |a: f64| Vector2::new(a.cos(), a.sin());
    let at = Point2::new(x as f64, y as f64) + shift;
    Some(Saddle { at, edges: [direction(angle + spread), direction(angle - spread + std::f64::consts::PI)] })
}

/// The point at which brightness changes only across lines through it: around a corner every gradient is square to the way
/// from the corner to it (as Förstner and Gülch 1987 find it). `half` is the half width of the window, pixels.
pub(crate) fn refine(picture: &Grey, start: Point2<f64>, half: f64) -> Option<Point2<f64>> {
    let reach = half.round().max(2.0) as isize;
    let mut at = start;
    for _ in 0..ROUNDS {
        let (mut a, mut b) = (Matrix2::zeros(), Vector2::zeros());
        for dy in -reach..=reach {
            for dx in -reach..=reach {
                let offset = Vector2::new(dx as f64, dy as f64);
                let p = at + offset;
                let slope = Vector2::new(
                    picture.sample(p.x + 1.0, p.y) - picture.sample(p.x - 1.0, p.y),
                    picture.sample(p.x, p.y + 1.0) - picture.sample(p.x, p.y - 1.0),
                );
                let weight = (-offset.norm_squared() / (half * half)).exp();
                let g = slope * slope.transpose() * weight;
                a += g;
                b += g * offset;
            }
        }
        let shift = a.try_inverse()? * b;
        at += shift;
        if !(at - start).norm().is_finite() || (at - start).norm() > half.max(2.0) {
            return None;
        }
        if shift.norm() < STILL {
            break;
        }
    }
    Some(at)
}
