//! Linear inequalities on a Gauss–Newton step (Hu et al. 2017, eq. 6: the body stays inside the dressed scan).

use nalgebra::{Cholesky, DVector, Dyn};

/// Sweeps over all bounds; a limb that presses against cloth on all sides settles within some ten.
const SWEEPS: usize = 60;
/// How far a bound gives way per unit of force. A bound is as stiff as a thousand vertices of unit weight, so that it is
/// hard where the bounds can be met at once, and bounds that contradict each other share the violation.
const COMPLIANCE: f64 = 1e-3;

/// `row · δ` is at least `lower`.
#[derive(Debug, Clone)]
pub(crate) struct Bound {
    pub row: DVector<f64>,
    pub lower: f64,
}

/// The step of minimum cost that keeps the bounds: `step` is that without them, `factor` that of the normal equations.
///
/// Hildreth's method: Gauss–Seidel on the forces of the bounds, in their order.
pub(crate) fn bounded(mut step: DVector<f64>, factor: &Cholesky<f64, Dyn>, bounds: &[Bound]) -> DVector<f64> {
    let pushes: Vec<DVector<f64>> = bounds.iter().map(|b| factor.solve(&b.row)).collect();
    let gives: Vec<f64> = bounds.iter().zip(&pushes).map(|(b, push)| b.row.dot(push) + COMPLIANCE).collect();
    let mut forces = vec![0.0f64; bounds.len()];
    for _ in 0..SWEEPS {
        for (i, bound) in bounds.iter().enumerate() {
            let missing = bound.lower - bound.row.dot(&step) - COMPLIANCE * forces[i];
            let force = (forces[i] + missing / gives[i]).max(0.0);
            step.axpy(force - forces[i], &pushes[i], 1.0);
            forces[i] = force;
        }
    }
    step
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;

    #[test]
    fn a_bound_that_is_violated_holds_and_others_do_not_act() {
        // ½ |δ − (1, 1)|² · 4 with δ_x ≤ 0.5 and δ_y ≥ −3
        let factor = (DMatrix::identity(2, 2) * 4.0).cholesky().unwrap();
        let bound = |x: f64, y: f64, lower| Bound { row: DVector::from_vec(vec![x, y]), lower };
        let step = bounded(DVector::from_element(2, 1.0), &factor, &[bound(-1.0, 0.0, -0.5), bound(0.0, 1.0, -3.0)]);
        assert!((step[0] - 0.5).abs() < 5e-3 && (step[1] - 1.0).abs() < 1e-12, "{step}");
    }

    #[test]
    fn bounds_that_contradict_each_other_share_the_violation() {
        // as stiff as the data of a thousand vertices
        let factor = (DMatrix::identity(1, 1) * 1000.0).cholesky().unwrap();
        let bound = |x: f64, lower| Bound { row: DVector::from_element(1, x), lower };
        let step = bounded(DVector::zeros(1), &factor, &[bound(1.0, 0.2), bound(-1.0, 0.2)]);
        assert!(step[0].abs() < 0.02, "{step}");
    }
}
