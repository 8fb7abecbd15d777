//! Stretch and shear of a triangle.
//!
//! With F = [u v], the rest directions of warp and weft as they lie now, and R the rotation closest to F, the energy of a square
//! metre is ½ stretch ((|u| − 1)² + (|v| − 1)²) + ½ · 2 shear ‖F − R‖². Its pure shear by an angle γ costs ½ shear γ². Both terms are squared
//! distances to a manifold, so that with the projection held fixed they are quadratic with a constant matrix (Bouaziz et
//! al. 2014, "Projective dynamics").

use nalgebra::{Matrix2, Matrix3x2, Point3, Vector2, Vector3};

/// Smallest double area of a triangle at rest, square metres.
const SMALLEST: f64 = 1e-12;

/// A triangle's rest shape.
#[derive(Debug, Clone)]
pub(crate) struct Element {
    pub vertices: [u32; 3],
    /// Area at rest, square metres.
    pub area: f64,
    /// F = Σ x(corner) · gradient(corner)ᵀ, by warp and weft.
    pub gradients: [Vector2<f64>; 3],
}

impl Element {
    /// The element of a triangle whose warp runs along `grain` as far as that lies in its plane; `None` for a sliver.
    pub fn new(vertices: [u32; 3], corners: [Point3<f64>; 3], grain: &Vector3<f64>) -> Option<Self> {
        let [a, b, c] = corners;
        let normal = (b - a).cross(&(c - a));
        let double = normal.norm();
        if double.is_nan() || double < SMALLEST {
            return None;
        }
        let n = normal / double;
        let along = grain - n * grain.dot(&n);
        let warp = along.try_normalize(1e-3).unwrap_or_else(|| (b - a).normalize());
        let weft = n.cross(&warp);
        let flat = |p: Point3<f64>| Vector2::new((p - a).dot(&warp), (p - a).dot(&weft));
        let edges = Matrix2::from_columns(&[flat(b), flat(c)]);
        let inverse = edges.try_inverse()?;
        let (gb, gc) = (inverse.row(0).transpose(), inverse.row(1).transpose());
        Some(Self { vertices, area: double / 2.0, gradients: [-gb - gc, gb, gc] })
    }

    /// F of the triangle as it lies in `x`.
    #[inline]
    pub fn deformation(&self, x: &[Vector3<f64>]) -> Matrix3x2<f64> {
        let mut f = Matrix3x2::zeros();
        for (v, g) in self.vertices.iter().zip(&self.gradients) {
            f += x[*v as usize] * g.transpose();
        }
        f
    }
}

/// Energy of a square metre and its derivative by F.
#[inline]
pub(crate) fn energy(f: &Matrix3x2<f64>, stretch: f64, shear: f64) -> (f64, Matrix3x2<f64>) {
    let (u, v) = (f.column(0), f.column(1));
    let (lu, lv) = (u.norm(), v.norm());
    let turned = f - rotation(f);
    let energy = 0.5 * stretch * ((lu - 1.0).powi(2) + (lv - 1.0).powi(2)) + shear * turned.norm_squared();
    let mut derivative = turned * (2.0 * shear);
    let pull = |l: f64| stretch * (1.0 - 1.0 / l.max(1e-9));
    derivative.column_mut(0).axpy(pull(lu), &u, 1.0);
    derivative.column_mut(1).axpy(pull(lv), &v, 1.0);
    (energy, derivative)
}

/// The matrix with orthonormal columns that is closest to F: F (FᵀF)^-½, in closed form for two columns.
#[inline]
pub(crate) fn rotation(f: &Matrix3x2<f64>) -> Matrix3x2<f64> {
    let c = f.transpose() * f;
    let s = c.determinant().max(0.0).sqrt();
    let t = (c.trace() + 2.0 * s).max(1e-18).sqrt();
    // S = (C + s I) / t is the root of C; its inverse by the adjugate.
    let (a, b, d) = ((c[(0, 0)] + s) / t, c[(0, 1)] / t, (c[(1, 1)] + s) / t);
    let determinant = (a * d - b * b).max(1e-9);
    f * (Matrix2::new(d, -b, -b, a) / determinant)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some_f() -> Matrix3x2<f64> {
        Matrix3x2::new(1.1, 0.2, -0.3, 0.8, 0.4, 0.1)
    }

    #[test]
    fn the_rotation_has_orthonormal_columns_and_is_nearest() {
        let (f, r) = (some_f(), rotation(&some_f()));
        assert!((r.transpose() * r - Matrix2::identity()).norm() < 1e-12);
        // FᵀR is the symmetric root: what makes R the nearest.
        let s = f.transpose() * r;
        assert!((s[(0, 1)] - s[(1, 0)]).abs() < 1e-12 && s.determinant() > 0.0);
    }

    #[test]
    fn the_derivative_is_that_of_the_energy() {
        let (f, h) = (some_f(), 1e-6);
        let (_, derivative) = energy(&f, 300.0, 50.0);
        for k in 0..6 {
            let (mut a, mut b) = (f, f);
            a[k] += h;
            b[k] -= h;
            let slope = (energy(&a, 300.0, 50.0).0 - energy(&b, 300.0, 50.0).0) / (2.0 * h);
            assert!((slope - derivative[k]).abs() < 1e-4, "{k}: {slope} {}", derivative[k]);
        }
    }

    #[test]
    fn a_pure_shear_costs_half_the_stiffness_times_the_angle_squared() {
        let angle: f64 = 0.02;
        let f = Matrix3x2::new(1.0, angle.sin(), 0.0, angle.cos(), 0.0, 0.0);
        let cost = energy(&f, 300.0, 50.0).0;
        assert!((cost / (0.5 * 50.0 * angle * angle) - 1.0).abs() < 0.01, "{cost}");
    }
}
