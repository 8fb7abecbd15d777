//! What a collapse costs: squared distances to weighted planes (Garland and Heckbert 1997).

use nalgebra::{Point3, Vector3};

/// The sum of squared distances to weighted planes.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Quadric {
    /// xx xy xz yy yz zz of the normals' outer products.
    a: [f64; 6],
    b: [f64; 3],
    c: f64,
}

impl Quadric {
    /// Adds the plane with unit normal `n` through `on`.
    pub fn add(&mut self, n: &Vector3<f64>, on: &Point3<f64>, weight: f64) {
        let d = -n.dot(&on.coords);
        let products = [n.x * n.x, n.x * n.y, n.x * n.z, n.y * n.y, n.y * n.z, n.z * n.z];
        self.a.iter_mut().zip(products).for_each(|(a, p)| *a += weight * p);
        (0..3).for_each(|k| self.b[k] += weight * d * n[k]);
        self.c += weight * d * d;
    }

    /// Adds another sum.
    pub fn take(&mut self, other: &Self) {
        self.a.iter_mut().zip(other.a).for_each(|(a, b)| *a += b);
        self.b.iter_mut().zip(other.b).for_each(|(a, b)| *a += b);
        self.c += other.c;
    }

    /// The sum at a point.
    pub fn at(&self, p: &Point3<f64>) -> f64 {
        let [xx, xy, xz, yy, yz, zz] = self.a;
        let (x, y, z) = (p.x, p.y, p.z);
        let quadratic = x * (xx * x + 2.0 * (xy * y + xz * z)) + y * (yy * y + 2.0 * yz * z) + zz * z * z;
        (quadratic + 2.0 * (self.b[0] * x + self.b[1] * y + self.b[2] * z) + self.c).max(0.0)
    }
}
