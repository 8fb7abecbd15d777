//! Closed-form geometry of one triangle.

use nalgebra::{Point3, Vector3};

/// Twice the area of a triangle, in f64.
#[inline]
pub(crate) fn double_area([a, b, c]: [Vector3<f64>; 3]) -> f64 {
    (b - a).cross(&(c - a)).norm()
}

/// Barycentric coordinates of the point of triangle `abc` closest to `p` (Ericson, Real-Time Collision
/// Detection, §5.1.5). The coordinates are non-negative and sum to 1, also for degenerate triangles.
pub fn closest_barycentric(p: &Point3<f32>, a: &Point3<f32>, b: &Point3<f32>, c: &Point3<f32>) -> [f32; 3] {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let v = ratio(d1, d1 - d3);
        return [1.0 - v, v, 0.0];
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let w = ratio(d2, d2 - d6);
        return [1.0 - w, 0.0, w];
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let w = ratio(d4 - d3, (d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - w, w];
    }
    let sum = va + vb + vc;
    if sum <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let (v, w) = (vb / sum, vc / sum);
    [1.0 - v - w, v, w]
}

fn ratio(n: f32, d: f32) -> f32 {
    if d > 0.0 { (n / d).clamp(0.0, 1.0) } else { 0.0 }
}

/// The point with barycentric coordinates `w` in triangle `abc`.
pub fn at(w: [f32; 3], a: &Point3<f32>, b: &Point3<f32>, c: &Point3<f32>) -> Point3<f32> {
    Point3::from(a.coords * w[0] + b.coords * w[1] + c.coords * w[2])
}

/// Ray parameter `t` and barycentric coordinates of the hit of `origin + t * direction` with `abc`, either side
/// (Möller and Trumbore 1997); `None` where it misses or runs parallel.
pub fn ray_hit(
    origin: &Point3<f32>,
    direction: &Vector3<f32>,
    [a, b, c]: &[Point3<f32>; 3],
) -> Option<(f32, [f32; 3])> {
    let (e1, e2) = (b - a, c - a);
    let q = direction.cross(&e2);
    let det = e1.dot(&q);
    if det.abs() < 1e-20 {
        return None;
    }
    let inv = 1.0 / det;
    let s = origin - a;
    let u = s.dot(&q) * inv;
    let r = s.cross(&e1);
    let v = direction.dot(&r) * inv;
    if u < 0.0 || v < 0.0 || u + v > 1.0 {
        return None;
    }
    let t = e2.dot(&r) * inv;
    (t >= 0.0).then_some((t, [1.0 - u - v, u, v]))
}
