//! Exact geometric predicates over single-precision coordinates.

use nalgebra::Point3;

/// Relative error bound of the determinant below in double precision, with reserve (Shewchuk 1997 gives 7.8e-16 for
/// the optimal evaluation order).
const FILTER: f64 = 1e-14;

/// Sign of det[b − a, c − a, d − a]: +1, 0 or −1, exact for all finite f32 input (no underflow: coordinates beyond
/// 1e-30 of one another are not treated specially).
pub fn orientation(a: &Point3<f32>, b: &Point3<f32>, c: &Point3<f32>, d: &Point3<f32>) -> i8 {
    let [pa, pb, pc, pd] = [a, b, c, d].map(|p| p.cast::<f64>());
    let (u, v, w) = (pb - pa, pc - pa, pd - pa);
    let det = u.cross(&v).dot(&w);
    let (au, av, aw) = (u.abs(), v.abs(), w.abs());
    let magnitude =
        (au.y * av.z + au.z * av.y) * aw.x + (au.z * av.x + au.x * av.z) * aw.y + (au.x * av.y + au.y * av.x) * aw.z;
    if det.abs() > FILTER * magnitude {
        return if det > 0.0 { 1 } else { -1 };
    }
    if magnitude == 0.0 { 0 } else { exact_sign(&[pa, pb, pc, pd]) }
}

/// Expands the 4×4 determinant into products of three coordinates, each held as an exact pair of doubles, and sums
/// them without rounding.
fn exact_sign(p: &[Point3<f64>; 4]) -> i8 {
    let mut sum: Vec<f64> = Vec::with_capacity(64);
    // det[b−a, c−a, d−a] = det(b,c,d) − det(a,c,d) + det(a,b,d) − det(a,b,c)
    for (rows, sign) in [([1, 2, 3], 1.0), ([0, 2, 3], -1.0), ([0, 1, 3], 1.0), ([0, 1, 2], -1.0)] {
        let [x, y, z] = rows.map(|i: usize| &p[i]);
        for (i, j, k, s) in
            [(0, 1, 2, 1.0), (1, 2, 0, 1.0), (2, 0, 1, 1.0), (2, 1, 0, -1.0), (0, 2, 1, -1.0), (1, 0, 2, -1.0)]
        {
            let two = sign * s * x[i] * y[j]; // 48 bits: exact
            let high = two * z[k];
            grow(&mut sum, two.mul_add(z[k], -high));
            grow(&mut sum, high);
        }
    }
    match sum.iter().rev().find(|v| **v != 0.0) {
        Some(v) if *v > 0.0 => 1,
        Some(_) => -1,
        None => 0,
    }
}

/// Adds `value` to an expansion whose parts grow in size and do not overlap (Shewchuk 1997, GROW-EXPANSION).
fn grow(expansion: &mut Vec<f64>, value: f64) {
    let mut carry = value;
    for part in expansion.iter_mut() {
        let sum = carry + *part;
        let virtual_part = sum - carry;
        *part = (carry - (sum - virtual_part)) + (*part - virtual_part);
        carry = sum;
    }
    expansion.push(carry);
    expansion.retain(|v| *v != 0.0);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_right_handed_corner_is_positive() {
        let o = Point3::origin();
        let (x, y, z) = (Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0), Point3::new(0.0, 0.0, 1.0));
        assert_eq!(orientation(&o, &x, &y, &z), 1);
        assert_eq!(orientation(&o, &y, &x, &z), -1);
    }

    #[test]
    fn one_unit_in_the_last_place_decides() {
        // Four points of the plane x + y + z = 1 whose coordinates are exact.
        let [a, b, c] = [[0.5, 0.25, 0.25], [0.125, 0.5, 0.375], [0.25, 0.125, 0.625]].map(Point3::from);
        let d = Point3::new(0.3125f32, 0.34375, 0.34375);
        assert_eq!(orientation(&a, &b, &c, &d), 0);
        let up = Point3::new(d.x, d.y, f32::from_bits(d.z.to_bits() + 1));
        let down = Point3::new(d.x, d.y, f32::from_bits(d.z.to_bits() - 1));
        let s = orientation(&a, &b, &c, &up);
        assert_ne!(s, 0);
        assert_eq!(orientation(&a, &b, &c, &down), -s);
    }

    #[test]
    fn exact_and_filtered_agree_where_both_are_sure() {
        for i in 0..200 {
            let t = i as f32;
            let p = [0.0, 1.0, 2.0, 3.0]
                .map(|k: f32| Point3::new((t * 1.3 + k).sin(), (t * 0.7 + 2.0 * k).cos(), (t * 0.31 + k * k).sin()));
            let exact = exact_sign(&p.map(Point3::cast::<f64>));
            assert_eq!(orientation(&p[0], &p[1], &p[2], &p[3]), exact);
        }
    }
}
