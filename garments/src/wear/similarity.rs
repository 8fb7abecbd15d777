//! The similarity (rotation, one scale, translation) that takes weighted points nearest to others: Umeyama 1991, in sums that can be
//! added up point by point.

use nalgebra::{Matrix3, Point3, Vector3};

/// A patch of points smaller than this says nothing about size, square metres: the mean square distance from their centre.
const SMALLEST: f64 = 1e-8;

/// Weighted sums over pairs of points.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sums {
    weight: f64,
    from: Vector3<f64>,
    to: Vector3<f64>,
    /// Σ w · to · fromᵀ.
    both: Matrix3<f64>,
    /// Σ w · |from|².
    square: f64,
}

impl Default for Sums {
    fn default() -> Self {
        let zero = Vector3::zeros();
        Self { weight: 0.0, from: zero, to: zero, both: Matrix3::zeros(), square: 0.0 }
    }
}

impl Sums {
    /// Adds a pair.
    pub fn add(&mut self, from: &Vector3<f64>, to: &Vector3<f64>, weight: f64) {
        let weighted = to * weight;
        self.weight += weight;
        self.from += from * weight;
        self.to += weighted;
        self.both += weighted * from.transpose();
        self.square += weight * from.norm_squared();
    }

    /// Adds other sums, which then weigh 1 altogether.
    pub fn add_mean(&mut self, other: &Self) {
        let share = 1.0 / other.weight.max(f64::MIN_POSITIVE);
        self.weight += 1.0;
        self.from += other.from * share;
        self.to += other.to * share;
        self.both += other.both * share;
        self.square += other.square * share;
    }

    /// The similarity that takes each `from` nearest to its `to`, as least squares; without weight it moves nothing.
    pub fn similarity(&self) -> Similarity {
        if self.weight <= 0.0 {
            return Similarity { linear: Matrix3::identity(), shift: Vector3::zeros() };
        }
        let (from, to) = (self.from / self.weight, self.to / self.weight);
        let cross = self.both / self.weight - to * from.transpose();
        let spread = self.square / self.weight - from.norm_squared();
        let linear = if spread < SMALLEST { Matrix3::identity() } else { scaled_rotation(&cross, spread) };
        Similarity { linear, shift: to - linear * from }
    }
}

/// The rotation nearest to `cross`, times the scale that goes with it.
fn scaled_rotation(cross: &Matrix3<f64>, spread: f64) -> Matrix3<f64> {
    let svd = cross.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return Matrix3::identity() };
    // A reflection is no movement: the weakest direction is turned round.
    let mut signs = Vector3::repeat(1.0);
    if (u * v_t).determinant() < 0.0 {
        signs[svd.singular_values.imin()] = -1.0;
    }
    let scale = svd.singular_values.dot(&signs) / spread;
    u * Matrix3::from_diagonal(&signs) * v_t * scale
}

/// A rotation with a scale, and a shift after it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Similarity {
    linear: Matrix3<f64>,
    shift: Vector3<f64>,
}

impl Similarity {
    /// Where it takes `p`.
    pub fn moved(&self, p: &Point3<f32>) -> Point3<f32> {
        Point3::from(self.linear * p.coords.cast::<f64>() + self.shift).cast()
    }
}
