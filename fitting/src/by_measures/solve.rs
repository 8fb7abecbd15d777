//! The coefficients that have the measures: min Σ ((m(β) − w) / σ)² + |β − β₀|².
//!
//! Levenberg–Marquardt. Slopes are found by differences at the start, then kept up by Broyden's rank-one updates (Broyden 1965), and found
//! anew where those do not lead on: a body is measured once a step instead of once a coefficient.

use nalgebra::{DMatrix, DVector};

use super::{
    names::Row,
    shapes::{Around, Shapes},
};
use crate::{FittingError, MeasureTable};

/// Deviation of a measure, as a share of what the standard allows: four of them fit in.
const SHARE: f64 = 0.25;
/// Steps at most.
const STEPS: usize = 24;
/// A step that gains less than this share of the cost is the last, or slopes are found anew.
const GAIN: f64 = 0.02;
/// Slopes are found anew at most so often.
const RENEWED: usize = 2;
/// Damping at first.
const DAMPING: f64 = 1e-3;

/// The body that was found.
pub(super) struct Solved {
    pub beta: Vec<f64>,
    pub table: MeasureTable,
    /// Metres for a standard deviation, around the body.
    pub slopes: DMatrix<f64>,
    pub iterations: usize,
}

/// # Errors
/// As [`crate::measure_table`].
pub(super) fn solve(shapes: &Shapes, rows: &[Row], around: &Around) -> Result<Solved, FittingError> {
    let mut beta = DVector::from_column_slice(&shapes.start);
    let mut table = around.table.clone();
    let mut jacobian = around.slopes(rows);
    let (mut damping, mut renewed, mut iterations) = (DAMPING, 0, 0);
    while iterations < STEPS && !rows.is_empty() {
        iterations += 1;
        let before = cost(shapes, rows, &beta, &table);
        let next = &beta + step(shapes, rows, &beta, &table, &jacobian, damping);
        let there = shapes.measured(next.as_slice())?;
        let gain = before - cost(shapes, rows, &next, &there);
        update(&mut jacobian, rows, (&beta, &table), (&next, &there));
        if gain > 0.0 {
            (beta, table) = (next, there);
            damping *= 0.2;
        } else {
            damping *= 8.0;
        }
        if gain > GAIN * before {
            continue;
        }
        if are_met(rows, &table) || renewed == RENEWED {
            break;
        }
        jacobian = shapes.around(beta.as_slice(), table.clone())?.slopes(rows);
        (damping, renewed) = (DAMPING, renewed + 1);
    }
    Ok(Solved { beta: beta.as_slice().to_vec(), table, slopes: jacobian, iterations })
}

/// What a measure may be off in the cost, metres: of one that is only held, all that is allowed.
fn sigma(row: &Row) -> f64 {
    if row.is_held { row.allowed() } else { SHARE * row.allowed() }
}

/// Whether each measure that was asked for is within twice its deviation, half of what is allowed.
fn are_met(rows: &[Row], table: &MeasureTable) -> bool {
    rows.iter().filter(|row| !row.is_held).all(|row| (row.of(table) - row.wanted).abs() <= 2.0 * sigma(row))
}

fn cost(shapes: &Shapes, rows: &[Row], beta: &DVector<f64>, table: &MeasureTable) -> f64 {
    let prior = (beta - DVector::from_column_slice(&shapes.start)).norm_squared();
    prior + rows.iter().map(|row| ((row.of(table) - row.wanted) / sigma(row)).powi(2)).sum::<f64>()
}

/// The damped step. With fewer measures than coefficients it is solved in the measures' space: for δ = (I μ + JᵀS²J)⁻¹ … the
/// identity (push-through) leaves a system as large as the measures are many.
fn step(
    shapes: &Shapes,
    rows: &[Row],
    beta: &DVector<f64>,
    table: &MeasureTable,
    jacobian: &DMatrix<f64>,
    damping: f64,
) -> DVector<f64> {
    let mu = 1.0 + damping;
    let scaled = DMatrix::from_fn(jacobian.nrows(), jacobian.ncols(), |r, c| jacobian[(r, c)] / sigma(&rows[r]));
    let miss = DVector::from_fn(rows.len(), |r, _| (rows[r].wanted - rows[r].of(table)) / sigma(&rows[r]));
    // where the prior alone would go, and what the measures pull beside it
    let home = (DVector::from_column_slice(&shapes.start) - beta) / mu;
    let left = miss - &scaled * &home;
    let among = &scaled * scaled.transpose() / mu + DMatrix::identity(rows.len(), rows.len());
    let pull = among.cholesky().map_or_else(|| DVector::zeros(rows.len()), |c| c.solve(&left));
    home + scaled.transpose() * pull / mu
}

/// Broyden's update: the slopes along the step become what was found.
fn update(
    jacobian: &mut DMatrix<f64>,
    rows: &[Row],
    (beta, here): (&DVector<f64>, &MeasureTable),
    (next, there): (&DVector<f64>, &MeasureTable),
) {
    let way = next - beta;
    let length = way.norm_squared();
    if length < 1e-12 {
        return;
    }
    let found = DVector::from_fn(rows.len(), |r, _| rows[r].of(there) - rows[r].of(here));
    let off = found - &*jacobian * &way;
    *jacobian += off * way.transpose() / length;
}
