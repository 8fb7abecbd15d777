//! Screened Poisson equations on a surface, by conjugate gradients.

use crate::{Mesh, areas::triangle_area, topology::Edges};

/// Residual, relative to the right side, at which the solver stops.
const TOLERANCE: f32 = 1e-4;
/// Maximum number of iterations.
const ITERATIONS: usize = 400;

/// Mass and stiffness of a surface: vertex areas, and dual length over length of each edge.
#[derive(Debug, Clone)]
pub struct SurfaceSystem {
    /// Vertex areas, square metres.
    pub areas: Vec<f32>,
    starts: Vec<u32>,
    others: Vec<u32>,
    stiffness: Vec<f32>,
}

impl SurfaceSystem {
    /// The system of a mesh.
    pub fn new(mesh: &Mesh) -> Self {
        let edges = Edges::new(&mesh.triangles);
        let n = mesh.positions.len();
        let (mut areas, mut dual) = (vec![0.0f32; n], vec![0.0f32; edges.vertices.len()]);
        for (t, sides) in edges.of_triangle.iter().enumerate() {
            let area = triangle_area(mesh.corners(t));
            mesh.triangles[t].iter().for_each(|&v| areas[v as usize] += area / 3.0);
            sides.iter().for_each(|&e| dual[e as usize] += 2.0 / 3.0 * area);
        }
        let stiffness = |e: usize| {
            let [i, j] = edges.vertices[e].map(|v| mesh.positions[v as usize]);
            // dual length / length, where dual length = (2/3 area) / length; slivers are held within reason.
            (dual[e] / (i - j).norm_squared().max(1e-10)).clamp(0.05, 5.0)
        };
        let mut rows: Vec<Vec<(u32, f32)>> = vec![Vec::new(); n];
        for (e, &[i, j]) in edges.vertices.iter().enumerate() {
            let s = stiffness(e);
            rows[i as usize].push((j, s));
            rows[j as usize].push((i, s));
        }
        let mut system = Self { areas, starts: vec![0], others: Vec::new(), stiffness: Vec::new() };
        for row in rows {
            for (other, s) in row {
                system.others.push(other);
                system.stiffness.push(s);
            }
            system.starts.push(system.others.len() as u32);
        }
        system
    }

    /// The system of some `vertices` while all others are held at zero, and what the held ones add to the diagonal.
    /// `local` maps all vertices to their place among `vertices`, or to `u32::MAX`.
    pub fn part(&self, vertices: &[u32], local: &[u32]) -> (Self, Vec<f32>) {
        let mut part = Self { areas: Vec::new(), starts: vec![0], others: Vec::new(), stiffness: Vec::new() };
        let mut held = vec![0.0; vertices.len()];
        for (i, &v) in vertices.iter().enumerate() {
            let v = v as usize;
            part.areas.push(self.areas[v]);
            for k in self.starts[v] as usize..self.starts[v + 1] as usize {
                match local[self.others[k] as usize] {
                    u32::MAX => held[i] += self.stiffness[k],
                    other => {
                        part.others.push(other);
                        part.stiffness.push(self.stiffness[k]);
                    }
                }
            }
            part.starts.push(part.others.len() as u32);
        }
        (part, held)
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.areas.len()
    }

    /// True for a mesh without vertices.
    pub fn is_empty(&self) -> bool {
        self.areas.is_empty()
    }

    /// Adds stiffness times `x` to `out`.
    pub fn add_stiffness(&self, x: &[f32], out: &mut [f32]) {
        for v in 0..x.len() {
            let mut sum = 0.0;
            for k in self.starts[v] as usize..self.starts[v + 1] as usize {
                sum += self.stiffness[k] * (x[v] - x[self.others[k] as usize]);
            }
            out[v] += sum;
        }
    }

    /// Sum of the stiffness around each vertex: the diagonal.
    pub fn diagonal(&self) -> Vec<f32> {
        (0..self.len())
            .map(|v| self.stiffness[self.starts[v] as usize..self.starts[v + 1] as usize].iter().sum())
            .collect()
    }

    /// The x that minimises ∫ anchor·(x − value)² + |∇x|²; `anchors` are 1 / length² of the smoothing, per square metre.
    pub fn smoothed(&self, values: &[f32], anchors: &[f32]) -> Vec<f32> {
        let mass: Vec<f32> = self.areas.iter().zip(anchors).map(|(a, k)| (a * k).max(1e-9)).collect();
        let right: Vec<f32> = mass.iter().zip(values).map(|(m, v)| m * v).collect();
        let diagonal: Vec<f32> = mass.iter().zip(self.diagonal()).map(|(m, d)| m + d).collect();
        conjugate_gradients(&right, values.to_vec(), &diagonal, |x, out| {
            for v in 0..x.len() {
                out[v] = mass[v] * x[v];
            }
            self.add_stiffness(x, out);
        })
    }
}

/// Solves A x = `right` for a symmetric positive definite A given by `apply(x, out)`, from the guess `x`, with its
/// diagonal as preconditioner. Sums run in order: the same bytes in every run.
pub fn conjugate_gradients(
    right: &[f32],
    mut x: Vec<f32>,
    diagonal: &[f32],
    apply: impl Fn(&[f32], &mut [f32]),
) -> Vec<f32> {
    let n = right.len();
    let mut ax = vec![0.0; n];
    apply(&x, &mut ax);
    let mut r: Vec<f32> = right.iter().zip(&ax).map(|(b, a)| b - a).collect();
    let precondition = |r: &[f32]| -> Vec<f32> { r.iter().zip(diagonal).map(|(r, d)| r / d.max(1e-20)).collect() };
    let mut z = precondition(&r);
    let mut p = z.clone();
    let mut rz = dot(&r, &z);
    let limit = f64::from(TOLERANCE).powi(2) * dot(right, &precondition(right)).max(1e-30);
    for _ in 0..ITERATIONS {
        if rz <= limit {
            break;
        }
        apply(&p, &mut ax);
        let curvature = dot(&p, &ax);
        if curvature <= 0.0 {
            break;
        }
        let step = (rz / curvature) as f32;
        for v in 0..n {
            x[v] += step * p[v];
            r[v] -= step * ax[v];
        }
        z = precondition(&r);
        let next = dot(&r, &z);
        let beta = (next / rz) as f32;
        rz = next;
        for v in 0..n {
            p[v] = z[v] + beta * p[v];
        }
    }
    x
}

fn dot(a: &[f32], b: &[f32]) -> f64 {
    a.iter().zip(b).map(|(&x, &y)| f64::from(x) * f64::from(y)).sum()
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    /// A square sheet of `n` by `n` vertices, 1 m wide.
    fn sheet(n: u32) -> Mesh {
        let place = |v: u32| Point3::new((v % n) as f32 / (n - 1) as f32, (v / n) as f32 / (n - 1) as f32, 0.0);
        let squares = (0..n - 1).flat_map(|y| (0..n - 1).map(move |x| y * n + x));
        let triangles = squares.flat_map(|a| [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]]).collect();
        Mesh::new((0..n * n).map(place).collect(), triangles)
    }

    #[test]
    fn smoothing_keeps_the_mean_and_removes_noise() {
        let mesh = sheet(30);
        let system = SurfaceSystem::new(&mesh);
        let noisy: Vec<f32> = (0..900).map(|v| 1.0 + if v % 2 == 0 { 0.3 } else { -0.3 }).collect();
        let smooth = system.smoothed(&noisy, &[1.0 / (0.2 * 0.2); 900]);
        let mean = |x: &[f32]| x.iter().zip(&system.areas).map(|(x, a)| x * a).sum::<f32>();
        assert!((mean(&smooth) - mean(&noisy)).abs() < 1e-3);
        assert!(smooth.iter().all(|x| (x - 1.0).abs() < 0.05));
    }

    #[test]
    fn held_vertices_pull_a_part_to_zero() {
        let mesh = sheet(5);
        let system = SurfaceSystem::new(&mesh);
        let mut local = vec![u32::MAX; 25];
        local[12] = 0;
        let (part, held) = system.part(&[12], &local);
        assert_eq!((part.len(), held[0]), (1, system.diagonal()[12]));
    }
}
