//! Logarithm and exponential of rigid transforms in closed form, and blending in log space.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

/// Below this angle, radians, series replace quotients whose numerator and denominator both vanish. Their first dropped term is
/// angle⁴ / 840, less than f64 resolves.
const SMALL_ANGLE: f64 = 1e-4;

/// The logarithm of a rigid transform: the screw motion that reaches it in one unit of time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Twist {
    /// Axis times angle, radians; at most π long where it is a logarithm.
    pub turn: Vector3<f64>,
    /// Velocity of the point that lies in the origin at the start, metres.
    pub shift: Vector3<f64>,
}

impl Twist {
    /// No motion.
    pub const ZERO: Self = Self { turn: Vector3::new(0.0, 0.0, 0.0), shift: Vector3::new(0.0, 0.0, 0.0) };

    /// Logarithm of `transform`. Of a half turn, which has two, either may come.
    pub fn log(transform: &Isometry3<f64>) -> Self {
        let turn = transform.rotation.scaled_axis();
        let (place, square) = (transform.translation.vector, turn.norm_squared());
        let angle = square.sqrt();
        let second = if angle < SMALL_ANGLE {
            1.0 / 12.0 + square / 720.0
        } else {
            (1.0 - 0.5 * angle / (0.5 * angle).tan()) / square
        };
        Self { turn, shift: place - 0.5 * turn.cross(&place) + second * turn.cross(&turn.cross(&place)) }
    }

    /// The transform whose logarithm this is.
    pub fn exp(&self) -> Isometry3<f64> {
        let square = self.turn.norm_squared();
        let angle = square.sqrt();
        let (first, second) = if angle < SMALL_ANGLE {
            (0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0)
        } else {
            ((1.0 - angle.cos()) / square, (angle - angle.sin()) / (square * angle))
        };
        let across = self.turn.cross(&self.shift);
        let place = self.shift + first * across + second * self.turn.cross(&across);
        Isometry3::from_parts(Translation3::from(place), UnitQuaternion::from_scaled_axis(self.turn))
    }
}

/// Blends `motions` (rigid transforms with weights that sum to 1) in log space: `reference` ∘ exp(Σ weight log(reference⁻¹ ∘ motion)).
///
/// Alexa's operator (Magnenat-Thalmann et al. 2004, eq. 3), but logarithms are taken relative to `reference`, one of the motions, so
/// that turning and moving everything turns and moves the result, and only turns of half a revolution between
/// the joints themselves are ambiguous. Of two motions either may be the reference.
pub fn blended(reference: &Isometry3<f64>, motions: impl IntoIterator<Item = (Isometry3<f64>, f64)>) -> Isometry3<f64> {
    let from_frame = reference.inverse();
    let mut sum = Twist::ZERO;
    for (motion, weight) in motions {
        let relative = Twist::log(&(from_frame * motion));
        sum.turn += weight * relative.turn;
        sum.shift += weight * relative.shift;
    }
    reference * sum.exp()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use nalgebra::Matrix4;

    use super::*;

    fn transform(i: u32, angle: f64) -> Isometry3<f64> {
        let t = f64::from(i);
        let axis = Vector3::new((1.3 * t).sin(), (2.1 * t).cos(), (0.7 * t + 1.0).sin()).normalize();
        Isometry3::new(Vector3::new((0.9 * t).cos(), 1.5 * (1.1 * t).sin(), (0.3 * t).sin()), axis * angle)
    }

    /// The 4×4 matrix of a twist.
    fn matrix(t: &Twist) -> Matrix4<f64> {
        let mut m = Matrix4::zeros();
        m.fixed_view_mut::<3, 3>(0, 0).copy_from(&t.turn.cross_matrix());
        m.fixed_view_mut::<3, 1>(0, 3).copy_from(&t.shift);
        m
    }

    #[test]
    fn the_matrix_exponential_of_the_logarithm_is_the_transform() {
        for (i, angle) in [0.0, 1e-9, 0.9e-4, 1.1e-4, 1e-3, 0.4, 1.7, 3.0, PI - 1e-7, PI].into_iter().enumerate() {
            let t = transform(i as u32, angle);
            let log = Twist::log(&t);
            // nalgebra's exponential is a Padé approximation of the whole matrix: nothing of the closed form is in it.
            let error = (matrix(&log).exp() - t.to_homogeneous()).norm();
            assert!(error < 1e-12, "{angle}: {error:e}");
            let error = (log.exp().to_homogeneous() - t.to_homogeneous()).norm();
            assert!(error < 1e-12, "{angle}: {error:e}");
        }
    }

    #[test]
    fn of_two_motions_either_may_be_the_reference() {
        for i in 0..20 {
            let (a, b, w) = (transform(i, 2.9), transform(i + 7, 0.4), 0.05 * f64::from(i));
            let both = [(a, 1.0 - w), (b, w)];
            let difference = blended(&a, both).to_homogeneous() - blended(&b, both).to_homogeneous();
            assert!(difference.norm() < 1e-9, "{i}: {:e}", difference.norm());
        }
    }

    #[test]
    fn moving_everything_moves_the_blend() {
        let motions = [(transform(1, 0.4), 0.5), (transform(2, 1.1), 0.3), (transform(3, 0.8), 0.2)];
        let moved = transform(4, 2.0);
        let after = blended(&(moved * motions[0].0), motions.map(|(m, w)| (moved * m, w)));
        let before = moved * blended(&motions[0].0, motions);
        assert!((after.to_homogeneous() - before.to_homogeneous()).norm() < 1e-12);
    }
}
