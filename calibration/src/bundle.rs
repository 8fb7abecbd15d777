//! Cameras, their places and the boards' places refined together, so that every corner falls where it was seen
//! (Levenberg–Marquardt on the distances in the pictures).

use nalgebra::{DMatrix, DVector, Isometry3, Point3, Translation3, UnitQuaternion, Vector2, Vector3};
use rayon::prelude::*;
use toile_geometry::{Rigid, camera::PinholeCamera, statistics::median};

use crate::board::Corner;

/// Steps at most, and the relative gain at which they end.
const STEPS: usize = 60;
const GAIN: f64 = 1e-9;
/// Damping at the start, and when it has grown so much that nothing helps.
const DAMPING: (f64, f64) = (1e-3, 1e9);
/// Corners beyond this many robust standard deviations count less (Huber's kernel).
const HUBER: f64 = 3.0;
/// Focal lengths, principal point, k1, k2, p1, p2. The sixth power of the radius (k3) is left alone: boards seldom reach far
/// enough out to tell it from k2.
const LENS: usize = 8;
const POSE: usize = 6;
/// Steps of the numeric derivatives: pixels, distortion, radians and metres.
const DELTA: f64 = 1e-6;

/// A camera of the problem.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Unknown {
    pub lens: PinholeCamera,
    /// The lens was told and stays.
    pub is_told: bool,
    pub camera_from_rig: Rigid,
}

/// Corners that a camera saw at a moment.
#[derive(Debug, Clone)]
pub(crate) struct Seen {
    pub camera: usize,
    pub moment: usize,
    pub corners: Vec<Corner>,
}

/// Everything that is refined. The first camera is the rig's frame.
#[derive(Debug, Clone)]
pub(crate) struct Bundle<'a> {
    pub cameras: Vec<Unknown>,
    /// `rig_from_board` at each moment.
    pub boards: Vec<Rigid>,
    pub seen: &'a [Seen],
    pub points: &'a [Point3<f64>],
}

impl Bundle<'_> {
    /// Refines; gives the last relative step's gain.
    pub(crate) fn refine(&mut self) {
        let mut damping = DAMPING.0;
        let mut spread = self.spread();
        let mut cost = self.cost(spread);
        for step in 0..STEPS {
            let (normal, gradient) = self.equations(spread);
            let moved = self.damped_step(&normal, &gradient, damping);
            let better = moved.map(|m| (m.cost(spread), m)).filter(|(c, _)| *c < cost);
            let Some((next, moved)) = better else {
                damping *= 8.0;
                if damping > DAMPING.1 {
                    return;
                }
                continue;
            };
            *self = moved;
            damping = (damping / 5.0).max(1e-9);
            let gain = (cost - next) / cost.max(1e-30);
            if gain < GAIN && step > 3 {
                return;
            }
            spread = self.spread();
            cost = self.cost(spread);
        }
    }

    /// Root mean square distance of a camera's corners from where they were seen, pixels.
    pub(crate) fn rms(&self, camera: usize) -> f64 {
        let of = self.seen.iter().filter(|s| s.camera == camera);
        let squares: Vec<f64> = of.flat_map(|s| self.residuals(s)).map(|r| r.norm_squared()).collect();
        (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
    }

    fn residuals(&self, seen: &Seen) -> Vec<Vector2<f64>> {
        let camera = &self.cameras[seen.camera];
        let camera_from_board = camera.camera_from_rig * self.boards[seen.moment];
        let residual = |corner: &Corner| {
            let pixel = camera.lens.project(&(camera_from_board * self.points[corner.id]));
            // A board that came behind the camera is far off.
            pixel.map_or_else(|| Vector2::repeat(1e4), |pixel| pixel - corner.at)
        };
        seen.corners.iter().map(residual).collect()
    }

    /// Robust standard deviation of the distances, pixels.
    fn spread(&self) -> f64 {
        let mut all: Vec<f64> = self.seen.iter().flat_map(|s| self.residuals(s)).map(|r| r.norm()).collect();
        // The median of the length of two normal numbers is 1.18 of their standard deviations.
        (median(&mut all).unwrap_or(0.0) / 1.177).max(1e-6)
    }

    fn cost(&self, spread: f64) -> f64 {
        let limit = HUBER * spread;
        let one = |r: Vector2<f64>| {
            let e = r.norm();
            if e <= limit { e * e } else { limit * (2.0 * e - limit) }
        };
        self.seen.iter().flat_map(|s| self.residuals(s)).map(one).sum()
    }

    /// Number of unknowns of the cameras, and of all.
    fn sizes(&self) -> (usize, usize) {
        let cameras = (LENS + POSE) * self.cameras.len();
        (cameras, cameras + POSE * self.boards.len())
    }

    fn equations(&self, spread: f64) -> (DMatrix<f64>, DVector<f64>) {
        let (cameras, all) = self.sizes();
        let blocks: Vec<_> = self.seen.par_iter().map(|s| (s, self.derivatives(s), self.residuals(s))).collect();
        let (mut normal, mut gradient) = (DMatrix::zeros(all, all), DVector::zeros(all));
        for (seen, columns, residuals) in blocks {
            let place = |k: usize| match k.checked_sub(LENS + POSE) {
                None => seen.camera * (LENS + POSE) + k,
                Some(k) => cameras + seen.moment * POSE + k,
            };
            let weight = |r: &Vector2<f64>| (HUBER * spread / r.norm().max(1e-12)).min(1.0);
            for (i, a) in columns.iter().enumerate() {
                gradient[place(i)] += a.iter().zip(&residuals).map(|(a, r)| weight(r) * a.dot(r)).sum::<f64>();
                for (j, b) in columns.iter().enumerate().take(i + 1) {
                    let value: f64 = a.iter().zip(b).zip(&residuals).map(|((a, b), r)| weight(r) * a.dot(b)).sum();
                    let (row, column) = (place(i).max(place(j)), place(i).min(place(j)));
                    normal[(row, column)] += value;
                }
            }
        }
        normal.fill_upper_triangle_with_lower_triangle();
        (normal, gradient)
    }

    /// How the residuals of a view change with its camera's lens and place and with the board's place.
    fn derivatives(&self, seen: &Seen) -> Vec<Vec<Vector2<f64>>> {
        (0..LENS + 2 * POSE)
            .map(|k| {
                let ends = [DELTA, -DELTA].map(|delta| {
                    let mut part = Bundle {
                        cameras: vec![self.cameras[seen.camera]],
                        boards: vec![self.boards[seen.moment]],
                        seen: &[],
                        points: self.points,
                    };
                    part.change(k, delta, seen.camera == 0);
                    part.residuals(&Seen { camera: 0, moment: 0, corners: seen.corners.clone() })
                });
                ends[0].iter().zip(&ends[1]).map(|(a, b)| (a - b) / (2.0 * DELTA)).collect()
            })
            .collect()
    }

    /// Changes one unknown of a part of one camera and one board.
    fn change(&mut self, k: usize, by: f64, is_first: bool) {
        let mut all = [0.0; LENS + 2 * POSE];
        all[k] = by;
        self.cameras[0].change(&all[..LENS + POSE], is_first);
        self.boards[0] = moved(&self.boards[0], &all[LENS + POSE..]);
    }

    /// The problem after a damped step; `None` where it has none.
    fn damped_step(&self, normal: &DMatrix<f64>, gradient: &DVector<f64>, damping: f64) -> Option<Self> {
        let mut damped = normal.clone();
        for k in 0..damped.nrows() {
            // Unknowns that stay have nothing on their diagonal.
            damped[(k, k)] += damping * normal[(k, k)] + if normal[(k, k)] > 0.0 { 0.0 } else { 1.0 };
        }
        let step = -damped.cholesky()?.solve(gradient);
        let (cameras, _) = self.sizes();
        let mut next = self.clone();
        for (c, camera) in next.cameras.iter_mut().enumerate() {
            camera.change(&step.as_slice()[c * (LENS + POSE)..][..LENS + POSE], c == 0);
        }
        for (m, board) in next.boards.iter_mut().enumerate() {
            *board = moved(board, &step.as_slice()[cameras + m * POSE..][..POSE]);
        }
        Some(next)
    }
}

impl Unknown {
    /// Changes lens and place, unless they are told; the first camera stays.
    fn change(&mut self, by: &[f64], is_first: bool) {
        if !self.is_told {
            let d = &mut self.lens.distortion;
            // Lengths are changed by shares of the focal length, so that all unknowns are of about one size.
            let f = self.lens.fx;
            (self.lens.fx, self.lens.fy) = (self.lens.fx + f * by[0], self.lens.fy + f * by[1]);
            (self.lens.cx, self.lens.cy) = (self.lens.cx + f * by[2], self.lens.cy + f * by[3]);
            (0..4).for_each(|k| d[k] += by[4 + k]);
        }
        if !is_first {
            self.camera_from_rig = moved(&self.camera_from_rig, &by[LENS..]);
        }
    }
}

/// A pose turned (axis times angle, about its own origin) and moved.
fn moved(pose: &Rigid, by: &[f64]) -> Rigid {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(by[0], by[1], by[2]));
    let shift = Vector3::new(by[3], by[4], by[5]);
    Isometry3::from_parts(Translation3::from(pose.translation.vector + shift), turn * pose.rotation)
}
