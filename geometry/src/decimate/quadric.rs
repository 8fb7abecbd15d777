//! Quadrics: squared distances to weighted planes (Garland and Heckbert 1997).

use nalgebra::{Matrix3, Point3, Vector3};

/// Symmetric quadric: squared distance to weighted planes.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Quadric {
    /// xx xy xz yy yz zz of the normals' outer products.
    a: [f64; 6],
    b: [f64; 3],
    c: f64,
}

impl Quadric {
    /// Adds the plane with unit normal `n` through `on`.
    pub(super) fn add_plane(&mut self, n: &Vector3<f64>, on: &Point3<f64>, weight: f64) {
        let d = -n.dot(&on.coords);
        let products = [n.x * n.x, n.x * n.y, n.x * n.z, n.y * n.y, n.y * n.z, n.z * n.z];
        self.a.iter_mut().zip(products).for_each(|(a, p)| *a += weight * p);
        (0..3).for_each(|k| self.b[k] += weight * d * n[k]);
        self.c += weight * d * d;
    }

    /// Adds the squared distance to a point.
    #[inline]
    pub(super) fn add_point(&mut self, p: &Point3<f64>, weight: f64) {
        for k in [0, 3, 5] {
            self.a[k] += weight;
        }
        (0..3).for_each(|k| self.b[k] -= weight * p[k]);
        self.c += weight * p.coords.norm_squared();
    }

    #[inline]
    pub(super) fn plus(&self, other: &Self) -> Self {
        Self {
            a: std::array::from_fn(|k| self.a[k] + other.a[k]),
            b: std::array::from_fn(|k| self.b[k] + other.b[k]),
            c: self.c + other.c,
        }
    }

    #[inline]
    pub(super) fn trace(&self) -> f64 {
        self.a[0] + self.a[3] + self.a[5]
    }

    #[inline]
    pub(super) fn at(&self, p: &Point3<f64>) -> f64 {
        let [xx, xy, xz, yy, yz, zz] = self.a;
        let (x, y, z) = (p.x, p.y, p.z);
        let quadratic = x * (xx * x + 2.0 * (xy * y + xz * z)) + y * (yy * y + 2.0 * yz * z) + zz * z * z;
        quadratic + 2.0 * (self.b[0] * x + self.b[1] * y + self.b[2] * z) + self.c
    }

    /// The inverse of the matrix part by cofactors; `None` where it is singular.
    #[inline]
    pub(super) fn inverse(&self) -> Option<Matrix3<f64>> {
        let [xx, xy, xz, yy, yz, zz] = self.a;
        let (cxx, cxy, cxz) = (yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy);
        let determinant = xx * cxx + xy * cxy + xz * cxz;
        if determinant.is_nan() || determinant <= 1e-18 * self.trace().powi(3) {
            return None;
        }
        let (cyy, cyz, czz) = (xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy);
        Some(Matrix3::new(cxx, cxy, cxz, cxy, cyy, cyz, cxz, cyz, czz) / determinant)
    }

    /// The point with the minimum error, given the matrix part's inverse.
    #[inline]
    pub(super) fn minimum(&self, inverse: &Matrix3<f64>) -> Point3<f64> {
        Point3::from(-(inverse * Vector3::from(self.b)))
    }
}
