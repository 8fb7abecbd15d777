//! Bending, by the shape operator of each triangle.
//!
//! Over the edge of two triangles, y = Σ k(vertex) x(vertex) with cotangent weights k is the integrated curvature vector: as
//! long as the edge times the angle between the triangles. A triangle's shape operator is Λ = Σ over its edges of y / (2 area)
//! t tᵀ, with t the unit normal of the edge in the plane (the triangle-averaged operator of Grinspun et al. 2006,
//! "Computing discrete shape operators on general meshes"), and its energy ½ bending · area ‖Λ − Λ at rest‖². The single hinge of Bergou et
//! al. 2006 would be three times too stiff on a grid of right triangles. For a flat rest shape the energy is quadratic in x.

use nalgebra::{Point3, Vector3};
use toile_geometry::topology::Edges;

/// Cotangents are held within this, so that slivers do not rule the sheet.
const STEEPEST: f64 = 10.0;
/// Smallest area of a triangle that bends, square metres.
const SMALLEST: f64 = 1e-10;

/// A triangle and what lies across its edges.
#[derive(Debug, Clone)]
pub(crate) struct Bend {
    /// Its corners, then the corners across the edges from each corner to the next (a corner again at a border).
    pub vertices: [u32; 6],
    /// Weights of y for each edge: its first end, its second end, the corner opposite, the corner across.
    weights: [[f64; 4]; 3],
    /// |y| at rest for each edge, metres.
    rest: [f64; 3],
    /// (tₑ · tᶠ)² / (4 area), 1/m².
    products: [[f64; 3]; 3],
}

/// The places in [`Bend::vertices`] of an edge's weights.
const PLACES: [[usize; 4]; 3] = [[0, 1, 2, 3], [1, 2, 0, 4], [2, 0, 1, 5]];

impl Bend {
    fn curvature(&self, edge: usize, x: &[Vector3<f64>]) -> Vector3<f64> {
        PLACES[edge].iter().zip(self.weights[edge]).map(|(&k, w)| x[self.vertices[k] as usize] * w).sum()
    }

    /// Energy for a rigidity of 1 N·m; `add(vertex, derivative)` takes what it pulls at.
    #[inline]
    pub fn energy(&self, x: &[Vector3<f64>], mut add: impl FnMut(u32, Vector3<f64>)) -> f64 {
        let y: [Vector3<f64>; 3] = std::array::from_fn(|e| self.curvature(e, x));
        let off: [Vector3<f64>; 3] = std::array::from_fn(|e| match self.rest[e] {
            0.0 => y[e],
            rest => y[e] * (1.0 - rest / y[e].norm().max(1e-9)),
        });
        let mut energy = 0.0;
        for e in 0..3 {
            let pull: Vector3<f64> = (0..3).map(|f| off[f] * self.products[e][f]).sum();
            energy += 0.5 * off[e].dot(&pull);
            // off = y − rest ŷ turns with y: its derivative keeps what lies along y and shortens the rest.
            let pull = if self.rest[e] == 0.0 {
                pull
            } else {
                let (length, along) = (y[e].norm().max(1e-9), y[e].try_normalize(1e-9).unwrap_or_default());
                let shorter = (1.0 - self.rest[e] / length).clamp(-1.0, 1.0);
                pull * shorter + along * (along.dot(&pull) * (1.0 - shorter))
            };
            for (&k, w) in PLACES[e].iter().zip(self.weights[e]) {
                add(self.vertices[k], pull * w);
            }
        }
        energy
    }

    /// Entries (vertex, vertex, value) of the second derivative for a flat rest shape and a rigidity of 1 N·m.
    pub fn second_derivative(&self) -> [[f64; 6]; 6] {
        let mut of_edge = [[0.0; 6]; 3];
        for e in 0..3 {
            for (&k, w) in PLACES[e].iter().zip(self.weights[e]) {
                of_edge[e][k] += w;
            }
        }
        let mut out = [[0.0; 6]; 6];
        for (e, products) in self.products.iter().enumerate() {
            for (f, product) in products.iter().enumerate() {
                for i in 0..6 {
                    for j in 0..6 {
                        out[i][j] += product * of_edge[e][i] * of_edge[f][j];
                    }
                }
            }
        }
        out
    }
}

/// How all triangles bend. `curved` keeps the bends of the rest shape; otherwise it wants to be flat.
pub(crate) fn bends(positions: &[Point3<f64>], triangles: &[[u32; 3]], curved: bool) -> Vec<Bend> {
    let edges = Edges::new(triangles);
    let sides = edges.triangles();
    let bend = |t: usize| {
        let across: [Option<u32>; 3] = std::array::from_fn(|k| {
            let edge = edges.of_triangle[t][k] as usize;
            let other = sides[edge].into_iter().find(|&u| u != t as u32)?;
            let [a, b] = edges.vertices[edge];
            triangles.get(other as usize)?.iter().copied().find(|&v| v != a && v != b)
        });
        of_triangle(positions, triangles[t], across, curved)
    };
    (0..triangles.len()).filter_map(bend).collect()
}

fn of_triangle(positions: &[Point3<f64>], t: [u32; 3], across: [Option<u32>; 3], curved: bool) -> Option<Bend> {
    let at = |v: u32| positions[v as usize];
    let normal = (at(t[1]) - at(t[0])).cross(&(at(t[2]) - at(t[0])));
    let area = normal.norm() / 2.0;
    if area.is_nan() || area < SMALLEST {
        return None;
    }
    let side = |k: usize| (at(t[(k + 1) % 3]) - at(t[k])).cross(&normal).normalize();
    let sides: [Vector3<f64>; 3] = std::array::from_fn(side);
    let products = std::array::from_fn(|e| std::array::from_fn(|f| sides[e].dot(&sides[f]).powi(2) / (4.0 * area)));
    let weights = std::array::from_fn(|k| {
        across[k].map_or([0.0; 4], |o| edge_weights(at(t[k]), at(t[(k + 1) % 3]), at(t[(k + 2) % 3]), at(o)))
    });
    let [a, b, c] = t;
    let vertices = [a, b, c, across[0].unwrap_or(a), across[1].unwrap_or(b), across[2].unwrap_or(c)];
    let mut bend = Bend { vertices, weights, rest: [0.0; 3], products };
    if curved {
        let y = |k: usize| -> Vector3<f64> {
            PLACES[k].iter().zip(bend.weights[k]).map(|(&p, w)| at(vertices[p]).coords * w).sum()
        };
        bend.rest = std::array::from_fn(|k| y(k).norm());
    }
    Some(bend)
}

/// Weights of the ends a and b and of the corners c and d on either side.
fn edge_weights(a: Point3<f64>, b: Point3<f64>, c: Point3<f64>, d: Point3<f64>) -> [f64; 4] {
    let cotangent = |from: Point3<f64>, to: Point3<f64>, o: Point3<f64>| {
        let (e, f) = (to - from, o - from);
        (e.dot(&f) / e.cross(&f).norm().max(1e-12)).clamp(-STEEPEST, STEEPEST)
    };
    let (ac, ad, bc, bd) = (cotangent(a, b, c), cotangent(a, b, d), cotangent(b, a, c), cotangent(b, a, d));
    [bc + bd, ac + ad, -ac - bc, -ad - bd]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip bent around a cylinder, and flat.
    #[allow(clippy::type_complexity)]
    fn strip(n: u32, radius: f64, width: f64) -> (Vec<Point3<f64>>, Vec<Point3<f64>>, Vec<[u32; 3]>) {
        let bent = |i: u32, row: u32| {
            let angle = f64::from(i) * 0.02;
            Point3::new(radius * angle.sin(), f64::from(row) * width, radius * angle.cos())
        };
        let step = 2.0 * radius * (0.01f64).sin();
        let flat = |i: u32, row: u32| Point3::new(f64::from(i) * step, f64::from(row) * width, 0.0);
        let bent = (0..3).flat_map(|row| (0..n).map(move |i| bent(i, row))).collect();
        let flat = (0..3).flat_map(|row| (0..n).map(move |i| flat(i, row))).collect();
        let cell = |q: u32| q / (n - 1) * n + q % (n - 1);
        let cut = |i: u32| [[i, i + 1, n + i], [i + 1, n + i + 1, n + i]];
        (bent, flat, (0..2 * (n - 1)).map(cell).flat_map(cut).collect())
    }

    #[test]
    fn a_cylinder_costs_half_its_curvature_squared() {
        let (n, radius) = (60, 0.1);
        let (bent, flat, triangles) = strip(n, radius, 0.003);
        let x: Vec<Vector3<f64>> = bent.iter().map(|p| p.coords).collect();
        let total: f64 = bends(&flat, &triangles, false).iter().map(|b| b.energy(&x, |_, _| {})).sum();
        let area = f64::from(n - 2) * (flat[1] - flat[0]).norm() * 0.006;
        let expected = 0.5 / (radius * radius) * area;
        assert!((total / expected - 1.0).abs() < 0.03, "{total} against {expected}");
        let at_rest: f64 = bends(&bent, &triangles, true).iter().map(|b| b.energy(&x, |_, _| {})).sum();
        assert!(at_rest < 1e-12, "{at_rest}");
    }

    #[test]
    fn the_derivative_is_that_of_the_energy() {
        let (bent, flat, triangles) = strip(8, 0.05, 0.004);
        for rest in [&flat, &bent] {
            let bends = bends(rest, &triangles, std::ptr::eq(rest, &raw const bent));
            let mut x: Vec<Vector3<f64>> = bent.iter().map(|p| p.coords).collect();
            x.iter_mut().enumerate().for_each(|(v, p)| p.z += 3e-4 * (v as f64 * 1.3).sin());
            let mut slope = vec![Vector3::zeros(); x.len()];
            bends.iter().for_each(|b| {
                b.energy(&x, |v, d| slope[v as usize] += d);
            });
            for (v, k) in [(9, 0), (10, 2), (12, 1), (3, 2)] {
                let mut at = |h: f64| {
                    x[v][k] += h;
                    let e: f64 = bends.iter().map(|b| b.energy(&x, |_, _| {})).sum();
                    x[v][k] -= h;
                    e
                };
                let measured = (at(1e-7) - at(-1e-7)) / 2e-7;
                assert!(
                    (measured - slope[v][k]).abs() < 1e-3 * slope[v][k].abs().max(0.1),
                    "{measured} {}",
                    slope[v][k]
                );
            }
        }
    }
}
