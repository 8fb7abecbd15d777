//! Triangulation of a closed polygon in space with minimum area (Barequet and Sharir 1995).

use std::collections::BTreeMap;

use nalgebra::{Point3, RealField};

/// A polygon with more corners is first cut in two by its best chord.
const MAX_CORNERS: usize = 420;

/// f32 or f64.
pub trait Scalar: RealField + Copy + Into<f64> + From<f32> {}
impl Scalar for f32 {}
impl Scalar for f64 {}

/// Triangles (corner indices, in the polygon's direction) with minimum total area, by dynamic programming, O(n³); very
/// long polygons are cut in two first. `blocked(i, k)` forbids the chord between two corners that are not
/// neighbours. `None` for fewer than three corners and where no triangulation avoids the blocked chords.
pub fn triangulate<T: Scalar>(points: &[Point3<T>], blocked: &dyn Fn(usize, usize) -> bool) -> Option<Vec<[u32; 3]>> {
    let all: Vec<usize> = (0..points.len()).collect();
    let mut triangles = Vec::with_capacity(points.len().saturating_sub(2));
    divide(points, &all, blocked, &mut triangles).then_some(triangles)
}

fn divide<T: Scalar>(
    points: &[Point3<T>],
    ring: &[usize],
    blocked: &dyn Fn(usize, usize) -> bool,
    out: &mut Vec<[u32; 3]>,
) -> bool {
    if ring.len() < 3 {
        return false;
    }
    if ring.len() <= MAX_CORNERS {
        return minimum_area(points, ring, blocked, out);
    }
    let Some((a, b)) = best_chord(points, ring, blocked) else { return false };
    let near: Vec<usize> = ring[a..=b].to_vec();
    let far: Vec<usize> = ring[b..].iter().chain(&ring[..=a]).copied().collect();
    divide(points, &near, blocked, out) && divide(points, &far, blocked, out)
}

/// The shortest free chord with at least a quarter of the ring on each side.
fn best_chord<T: Scalar>(
    points: &[Point3<T>],
    ring: &[usize],
    blocked: &dyn Fn(usize, usize) -> bool,
) -> Option<(usize, usize)> {
    let n = ring.len();
    let step = (n / 256).max(1);
    let mut best: BTreeMap<u64, (usize, usize)> = BTreeMap::new();
    for a in (0..n).step_by(step) {
        for b in (a + n / 4..n.min(a + n - n / 4)).step_by(step) {
            if !blocked(ring[a], ring[b]) {
                let d: f64 = (points[ring[a]] - points[ring[b]]).norm().into();
                best.entry(d.to_bits()).or_insert((a, b));
            }
        }
    }
    best.into_values().next()
}

fn minimum_area<T: Scalar>(
    points: &[Point3<T>],
    ring: &[usize],
    blocked: &dyn Fn(usize, usize) -> bool,
    out: &mut Vec<[u32; 3]>,
) -> bool {
    let n = ring.len();
    let area = |i: usize, j: usize, k: usize| {
        let [a, b, c] = [i, j, k].map(|x| points[ring[x]]);
        (b - a).cross(&(c - a)).norm()
    };
    let mut cost = vec![T::zero(); n * n];
    let mut middle = vec![0u32; n * n];
    for gap in 2..n {
        for i in 0..n - gap {
            let k = i + gap;
            let closing = i == 0 && k == n - 1;
            let mut best = (T::from(f32::INFINITY), 0);
            if closing || !blocked(ring[i], ring[k]) {
                for j in i + 1..k {
                    let c = cost[i * n + j] + cost[j * n + k];
                    if c < best.0 {
                        let c = c + area(i, j, k);
                        if c < best.0 {
                            best = (c, j);
                        }
                    }
                }
            }
            cost[i * n + k] = best.0;
            middle[i * n + k] = best.1 as u32;
        }
    }
    if !Into::<f64>::into(cost[n - 1]).is_finite() {
        return false;
    }
    let mut stack = vec![(0, n - 1)];
    while let Some((i, k)) = stack.pop() {
        if k - i >= 2 {
            let j = middle[i * n + k] as usize;
            out.push([ring[i] as u32, ring[j] as u32, ring[k] as u32]);
            stack.extend([(i, j), (j, k)]);
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_l_shape_is_covered_once() {
        let corners = [(0., 0.), (2., 0.), (2., 1.), (1., 1.), (1., 2.), (0., 2.)];
        let points: Vec<Point3<f64>> = corners.iter().map(|c| Point3::new(c.0, c.1, 0.0)).collect();
        let triangles = triangulate(&points, &|_, _| false).unwrap();
        let signed = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| points[v as usize]);
            (b - a).cross(&(c - a)).z * 0.5
        };
        assert_eq!(triangles.len(), 4);
        assert!(triangles.iter().all(|t| signed(t) > -1e-12));
        assert!((triangles.iter().map(signed).sum::<f64>() - 3.0).abs() < 1e-12);
    }

    #[test]
    fn a_long_ring_is_cut_and_covered() {
        let n = 1500;
        let points: Vec<Point3<f64>> = (0..n)
            .map(|i| {
                let a = std::f64::consts::TAU * i as f64 / n as f64;
                Point3::new(3.0 * a.cos(), a.sin(), 0.0)
            })
            .collect();
        let triangles = triangulate(&points, &|_, _| false).unwrap();
        assert_eq!(triangles.len(), n - 2);
    }
}
