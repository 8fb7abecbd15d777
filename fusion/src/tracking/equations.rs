//! Normal equations of point-to-plane problems, and the step that they ask for.

use nalgebra::{Isometry3, Matrix6, Point3, Translation3, UnitQuaternion, Vector3, Vector6};
use rayon::prelude::*;
use toile_geometry::Rigid;

use super::samples::Sample;

/// Points of a parallel task; fixed, so that sums do not depend on the number of threads.
pub(crate) const CHUNK: usize = 512;

/// Normal equations of a point-to-plane problem about a centre. Increments are [rotation, translation].
#[derive(Debug, Clone, Copy)]
pub(crate) struct NormalEquations {
    /// Only the lower half is summed; [`Self::symmetric`] gives the whole.
    pub hessian: Matrix6<f64>,
    pub gradient: Vector6<f64>,
    /// Weighted sum of squared residuals, and of weights.
    pub squares: f64,
    pub weight: f64,
    /// Residuals with a weight.
    pub count: usize,
}

/// The residual of one sample.
pub(crate) struct Residual {
    /// Signed distance (metres), or difference of grey values.
    pub value: f64,
    /// Its gradient along the point, model frame.
    pub gradient: [f32; 3],
    /// Weight of the robust kernel, 0 to 1, over the square of the residual's spread where residuals of several kinds meet.
    pub kernel: f64,
}

/// A Gauss–Newton step.
pub(crate) struct Step {
    /// The motion, to be applied from the left.
    pub motion: Rigid,
    /// Its size in metres at the subject's radius.
    pub size: f64,
}

/// Sums the weighted normal equations of left increments about `center`: a residual r with the gradient n at q has the
/// row [(q − c) × n, n]. `measure` gets the sample, its position and its normal in the model's frame.
pub(crate) fn accumulate(
    points: &[Sample],
    pose: &Rigid,
    center: &Point3<f64>,
    measure: impl Fn(&Sample, &Point3<f32>, [f32; 3]) -> Option<Residual> + Sync,
) -> NormalEquations {
    let rotation = pose.rotation.cast::<f32>();
    let parts: Vec<NormalEquations> = points
        .par_chunks(CHUNK)
        .map(|chunk| {
            let mut sum = NormalEquations::zero();
            for s in chunk {
                let q = toile_geometry::transform_point(pose, &s.point);
                let n = rotation * Vector3::from(s.normal);
                if let Some(r) = measure(s, &q, n.into()) {
                    sum.add(&q, center, r.gradient, r.value, r.kernel * f64::from(s.weight));
                }
            }
            sum
        })
        .collect();
    parts.iter().fold(NormalEquations::zero(), |a, b| a.plus(b))
}

impl NormalEquations {
    pub(crate) fn zero() -> Self {
        Self { hessian: Matrix6::zeros(), gradient: Vector6::zeros(), squares: 0.0, weight: 0.0, count: 0 }
    }

    #[inline]
    pub(crate) fn add(&mut self, q: &Point3<f32>, center: &Point3<f64>, normal: [f32; 3], r: f64, weight: f64) {
        if weight <= 0.0 {
            return;
        }
        let n = Vector3::from(normal).cast::<f64>();
        let m = (q.cast::<f64>() - center).cross(&n);
        let row = [m.x, m.y, m.z, n.x, n.y, n.z];
        for i in 0..6 {
            let wi = weight * row[i];
            for (j, column) in row.iter().enumerate().take(i + 1) {
                self.hessian[(i, j)] += wi * column;
            }
            self.gradient[i] += wi * r;
        }
        self.squares += weight * r * r;
        self.weight += weight;
        self.count += 1;
    }

    pub(crate) fn plus(&self, other: &Self) -> Self {
        Self {
            hessian: self.hessian + other.hessian,
            gradient: self.gradient + other.gradient,
            squares: self.squares + other.squares,
            weight: self.weight + other.weight,
            count: self.count + other.count,
        }
    }

    /// The full symmetric matrix.
    pub(crate) fn symmetric(&self) -> Matrix6<f64> {
        Matrix6::from_fn(|i, j| if i >= j { self.hessian[(i, j)] } else { self.hessian[(j, i)] })
    }

    /// The damped Gauss–Newton step about the centre; none at all where the system cannot be solved.
    pub(crate) fn step(&self, center: &Point3<f64>, damping: f64) -> Step {
        let h = self.symmetric();
        let lever = damping * h.trace() / 6.0;
        let damped = h + Matrix6::identity() * lever.max(1e-12);
        let Some(factor) = damped.cholesky() else { return Step { motion: Rigid::identity(), size: 0.0 } };
        let x = -factor.solve(&self.gradient);
        let size = (x.fixed_rows::<3>(0).norm_squared() * 0.25 + x.fixed_rows::<3>(3).norm_squared()).sqrt();
        Step { motion: increment(&x, center), size }
    }
}

/// The motion of increment [rotation, translation] about a centre.
pub(crate) fn increment(x: &Vector6<f64>, center: &Point3<f64>) -> Rigid {
    let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(x[0], x[1], x[2]));
    let shift = Vector3::new(x[3], x[4], x[5]) + center.coords - rotation * center.coords;
    Isometry3::from_parts(Translation3::from(shift), rotation)
}
