//! Directions that measurements leave open: a column may turn without its surface moving.

use nalgebra::{Matrix6, SymmetricEigen, U6, Vector6};

use super::equations::NormalEquations;

/// A conditioning below this means that the shape leaves a direction open: a column's turn (a person's is above 0.01).
pub(crate) const DEGENERATE: f64 = 5e-3;
/// A direction with less than this share of the largest eigenvalue is open.
const OPEN: f64 = 1e-3;

/// An open direction in the units of a step and in those of a gradient, and what little the normal matrix holds of it.
struct OpenDirection {
    step: Vector6<f64>,
    gradient: Vector6<f64>,
    stiffness: f64,
}

/// Eigenvalues and vectors of the mean normal matrix with rotations scaled by the subject's size.
struct ScaledEigen {
    eigen: SymmetricEigen<f64, U6>,
    scale: Vector6<f64>,
}

/// Smallest over largest eigenvalue of the scaled normal matrix.
pub(crate) fn conditioning(system: &NormalEquations) -> f64 {
    let eigenvalues = ScaledEigen::new(system).eigen.eigenvalues;
    (eigenvalues.min() / eigenvalues.max().max(1e-12)).max(0.0)
}

/// Makes directions stiff that the measurements leave open: there the solution stays where it is, instead of following
/// the noise (after Zhang, Kaess and Singh 2016, "On degeneracy of optimization-based state estimation problems").
pub(crate) fn hold_open_directions(system: &mut NormalEquations) {
    let scaled = ScaledEigen::new(system);
    let largest = scaled.eigen.eigenvalues.max() * system.weight;
    for open in &scaled.open_directions(system) {
        system.gradient -= open.gradient * open.step.dot(&system.gradient);
        system.hessian += open.gradient * open.gradient.transpose() * largest;
    }
}

/// Takes away what noise says about directions that the measurements leave open: others may decide them.
pub(crate) fn drop_open_directions(system: &mut NormalEquations) {
    for open in &ScaledEigen::new(system).open_directions(system) {
        system.gradient -= open.gradient * open.step.dot(&system.gradient);
        system.hessian -= open.gradient * open.gradient.transpose() * open.stiffness;
    }
}

impl ScaledEigen {
    fn new(system: &NormalEquations) -> Self {
        let h = system.symmetric() / system.weight.max(1e-12);
        let rotations = h.fixed_view::<3, 3>(0, 0).trace();
        let translations = h.fixed_view::<3, 3>(3, 3).trace();
        let spread = (rotations / translations.max(1e-12)).sqrt().max(1e-6);
        let scale = Vector6::new(1.0 / spread, 1.0 / spread, 1.0 / spread, 1.0, 1.0, 1.0);
        let scaled = Matrix6::from_fn(|i, j| h[(i, j)] * scale[i] * scale[j]);
        Self { eigen: SymmetricEigen::new(scaled), scale }
    }

    fn open_directions(&self, system: &NormalEquations) -> Vec<OpenDirection> {
        let largest = self.eigen.eigenvalues.max();
        let open = |(k, e): (usize, &f64)| {
            let u: Vector6<f64> = self.eigen.eigenvectors.column(k).into();
            OpenDirection {
                step: u.component_mul(&self.scale),
                gradient: u.component_div(&self.scale),
                stiffness: e * system.weight,
            }
        };
        self.eigen.eigenvalues.iter().enumerate().filter(|(_, e)| **e < OPEN * largest).map(open).collect()
    }
}
