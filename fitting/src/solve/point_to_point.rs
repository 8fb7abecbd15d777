//! The seed's own objective: the distance of every vertex from its closest scan point, with nothing else
//! (Hu et al. 2017, eq. 4 to 6).

use nalgebra::{DVector, Vector3};
use rayon::prelude::*;

use super::{Articulated, Columns, Linearised, NormalEquations, Posed, Problem, Residual, State, bounds::Bound};
use crate::surface::Cloud;

/// A step below these ends a descent: metres and radians, and standard deviations of β.
const SMALL_MOVE: f64 = 2e-4;
const SMALL_BETA: f64 = 0.02;
/// Shorter distances weigh no more where plain norms are summed, metres: keeps the weights finite.
const SHORTEST: f64 = 1e-3;
/// Vertices deeper inside than this are not bounded in this step, metres: a step does not reach so far.
const NEAR: f32 = 0.03;

/// How distances are summed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Norm {
    /// As they are (eq. 4): iteratively reweighted.
    Plain,
    /// Squared (eq. 5 and 6).
    Squared,
}

/// Closest points without priors, gates, weights or normals.
pub(crate) struct PointToPoint<'a> {
    pub body: &'a Articulated,
    pub scan: &'a Cloud,
    pub columns: Columns,
    pub norm: Norm,
    /// Whether each vertex must stay on the inner side of its closest scan point (eq. 6).
    pub inside: bool,
}

impl Problem for PointToPoint<'_> {
    fn columns(&self) -> &Columns {
        &self.columns
    }

    fn linearised(&self, state: &State) -> Linearised {
        let posed = self.body.pose(state);
        let offsets = self.offsets(&posed);
        let residuals: Vec<Residual> = offsets.iter().enumerate().flat_map(|(v, d)| self.residuals(v, d)).collect();
        let equations = NormalEquations::accumulate(&residuals, self.body, &posed, &self.columns);
        let bounds = if self.inside { self.bounds(&posed, &offsets) } else { Vec::new() };
        Linearised { equations, frames: posed.frames, bounds }
    }

    fn is_small(&self, step: &[f64], _: f64) -> bool {
        let (moves, betas) = step.split_at(self.columns.first_beta());
        moves.iter().all(|d| d.abs() < SMALL_MOVE) && betas.iter().all(|d| d.abs() < SMALL_BETA)
    }

    fn solved_for(&self) -> &'static str {
        "the pose without priors"
    }
}

impl PointToPoint<'_> {
    /// Mean distance of the vertices from their closest scan points, metres.
    pub fn mean_distance(&self, state: &State) -> f64 {
        let offsets = self.offsets(&self.body.pose(state));
        offsets.iter().map(|d| f64::from(d.norm())).sum::<f64>() / offsets.len().max(1) as f64
    }

    /// From the closest scan point to each vertex, metres.
    fn offsets(&self, posed: &Posed) -> Vec<Vector3<f32>> {
        let offset = |v: usize| {
            let p = &posed.points[v];
            let q = self.scan.nearest(p, &posed.normals[v], f32::INFINITY, f32::NEG_INFINITY);
            q.map_or(Vector3::zeros(), |q| p - self.scan.samples.points[q as usize])
        };
        (0..self.body.len()).into_par_iter().with_min_len(128).map(offset).collect()
    }

    fn residuals(&self, v: usize, offset: &Vector3<f32>) -> [Residual; 3] {
        let weight = match self.norm {
            Norm::Plain => 1.0 / f64::from(offset.norm()).max(SHORTEST),
            Norm::Squared => 1.0,
        };
        [0, 1, 2].map(|axis| Residual {
            vertex: v as u32,
            normal: Vector3::ith(axis, 1.0),
            value: offset[axis],
            weight,
        })
    }

    /// (closest scan point − vertex) · normal of the vertex stays above 0.
    fn bounds(&self, posed: &Posed, offsets: &[Vector3<f32>]) -> Vec<Bound> {
        let bound = |(v, offset): (usize, &Vector3<f32>)| {
            let normal = posed.normals[v];
            let height = offset.dot(&normal);
            (height > -NEAR).then(|| {
                let mut row = DVector::zeros(self.columns.len());
                self.body.derivative(posed, v, &-normal.cast::<f64>(), &self.columns, row.as_mut_slice());
                Bound { row, lower: f64::from(height) }
            })
        };
        offsets.par_iter().enumerate().filter_map(bound).collect()
    }
}
