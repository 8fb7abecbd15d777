//! Normal equations of weighted point-to-plane residuals, summed in a fixed order.

use nalgebra::{DMatrix, DVector, Vector3};
use rayon::prelude::*;

use super::{
    Articulated, Columns, Posed,
    bounds::{Bound, bounded},
};

/// Residuals in one block of the sum; fixed, so that the sum is the same for any number of threads.
const BLOCK: usize = 512;

/// `normal · (vertex − point)`, weighted.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Residual {
    pub vertex: u32,
    pub normal: Vector3<f32>,
    /// Metres.
    pub value: f32,
    pub weight: f64,
}

/// H δ = −g of a Gauss–Newton step, and the cost ½ Σ w r² they come from.
pub(crate) struct NormalEquations {
    pub h: DMatrix<f64>,
    pub g: DVector<f64>,
    pub cost: f64,
}

impl NormalEquations {
    pub fn zeros(n: usize) -> Self {
        Self { h: DMatrix::zeros(n, n), g: DVector::zeros(n), cost: 0.0 }
    }

    /// The equations of all residuals of `body`, posed as `posed`, over `columns`.
    pub fn accumulate(residuals: &[Residual], body: &Articulated, posed: &Posed, columns: &Columns) -> Self {
        let of_block = |block: &[Residual]| {
            let mut rows = DMatrix::<f64>::zeros(columns.len(), block.len());
            let mut values = DVector::<f64>::zeros(block.len());
            for (k, r) in block.iter().enumerate() {
                let mut column = rows.column_mut(k);
                body.derivative(posed, r.vertex as usize, &r.normal.cast(), columns, column.as_mut_slice());
                let root = r.weight.sqrt();
                column *= root;
                values[k] = root * f64::from(r.value);
            }
            let cost = values.iter().map(|v| 0.5 * v * v).sum();
            Self { h: &rows * rows.transpose(), g: &rows * &values, cost }
        };
        let blocks: Vec<Self> = residuals.par_chunks(BLOCK).map(of_block).collect();
        let mut total = Self::zeros(columns.len());
        blocks.into_iter().for_each(|block| total.add(block));
        total
    }

    /// Adds the terms of another problem over the same unknowns.
    pub fn add(&mut self, other: Self) {
        self.h += other.h;
        self.g += other.g;
        self.cost += other.cost;
    }

    /// Adds a quadratic term ½ wᵀw with Jacobian `jacobian` (residuals × 3) on the columns `at`, `at` + 1, `at` + 2.
    pub fn add_triple(&mut self, at: usize, residual: &Vector3<f64>, jacobian: &nalgebra::Matrix3<f64>) {
        let h = jacobian.transpose() * jacobian;
        let g = jacobian.transpose() * residual;
        for r in 0..3 {
            self.g[at + r] += g[r];
            for c in 0..3 {
                self.h[(at + r, at + c)] += h[(r, c)];
            }
        }
        self.cost += 0.5 * residual.norm_squared();
    }

    /// Adds ½ (value / sigma)² on one column.
    pub fn add_single(&mut self, at: usize, value: f64, sigma: f64) {
        let w = 1.0 / (sigma * sigma);
        self.h[(at, at)] += w;
        self.g[at] += w * value;
        self.cost += 0.5 * w * value * value;
    }

    /// The Gauss–Newton step with Levenberg's `damping` relative to the diagonal that keeps to `bounds`; `None` where the
    /// equations are singular.
    pub fn step(mut self, damping: f64, bounds: &[Bound]) -> Option<DVector<f64>> {
        for i in 0..self.h.nrows() {
            let d = self.h[(i, i)];
            self.h[(i, i)] = d + damping * d + 1e-9;
        }
        let factor = self.h.cholesky()?;
        let step = bounded(factor.solve(&-self.g), &factor, bounds);
        step.iter().all(|x| x.is_finite()).then_some(step)
    }
}
