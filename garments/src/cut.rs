//! A mesh cut along the zero line of a vertex field, through its triangles.

use std::collections::BTreeMap;

use nalgebra::Point3;
use toile_geometry::Mesh;

use crate::scan_graph::ScanGraph;

/// Cut points keep this share of an edge away from its ends, so that no sliver has an edge of no length.
const AWAY_FROM_ENDS: f32 = 0.06;

/// Signed field of a label: +1 inside, −1 outside, diffused over the surface with standard deviation `deviation`
/// (metres), so that its zero line is the labels' border with the corners taken off.
pub fn smooth_field(graph: &ScanGraph, positions: &[Point3<f32>], inside: &[bool], deviation: f32) -> Vec<f32> {
    let mut field: Vec<f32> = inside.iter().map(|&i| if i { 1.0 } else { -1.0 }).collect();
    let squares: f64 = graph.edges.iter().map(|e| f64::from(length(positions, e).powi(2))).sum();
    let mean_square = (squares / graph.edges.len().max(1) as f64) as f32;
    // Moving half of the value by one edge adds a quarter of the edge's square to the variance along each direction.
    let steps = (4.0 * deviation * deviation / mean_square.max(1e-9)).ceil().min(200.0) as usize;
    let weights: Vec<f32> = graph
        .edges
        .iter()
        .zip(&graph.dual_lengths)
        .map(|(e, d)| (d / length(positions, e).max(1e-6)).max(0.05))
        .collect();
    for _ in 0..steps {
        let mut sums = vec![[0.0f32; 2]; field.len()];
        for (&[i, j], &w) in graph.edges.iter().zip(&weights) {
            for (a, b) in [(i, j), (j, i)] {
                sums[a as usize][0] += w * field[b as usize];
                sums[a as usize][1] += w;
            }
        }
        for (f, [sum, weight]) in field.iter_mut().zip(sums) {
            if weight > 0.0 {
                *f = 0.5 * *f + 0.5 * sum / weight;
            }
        }
    }
    field
}

fn length(positions: &[Point3<f32>], &[i, j]: &[u32; 2]) -> f32 {
    (positions[i as usize] - positions[j as usize]).norm()
}

/// The part of `mesh` where `field` is positive. Triangles that the zero line crosses are split; new vertices carry
/// interpolated colours, normals and attributes.
pub fn cut_positive(mesh: &Mesh, field: &[f32]) -> Mesh {
    let inside = |v: u32| field[v as usize] > 0.0;
    let mut cuts = Cuts { mesh: mesh.clone(), field, between: BTreeMap::new() };
    let mut triangles = Vec::new();
    for &[a, b, c] in &mesh.triangles {
        match [inside(a), inside(b), inside(c)] {
            [true, true, true] => triangles.push([a, b, c]),
            [false, false, false] => {}
            [true, false, false] => cuts.corner([a, b, c], &mut triangles),
            [false, true, false] => cuts.corner([b, c, a], &mut triangles),
            [false, false, true] => cuts.corner([c, a, b], &mut triangles),
            [false, true, true] => cuts.trapezium([a, b, c], &mut triangles),
            [true, false, true] => cuts.trapezium([b, c, a], &mut triangles),
            [true, true, false] => cuts.trapezium([c, a, b], &mut triangles),
        }
    }
    let mut all = cuts.mesh;
    all.triangles = triangles;
    all.filter_triangles(|_| true).0
}

struct Cuts<'a> {
    mesh: Mesh,
    field: &'a [f32],
    between: BTreeMap<[u32; 2], u32>,
}

impl Cuts<'_> {
    /// Only the first corner is inside.
    fn corner(&mut self, [a, b, c]: [u32; 3], out: &mut Vec<[u32; 3]>) {
        let (ab, ac) = (self.at(a, b), self.at(a, c));
        out.push([a, ab, ac]);
    }

    /// Only the first corner is outside; the quadrilateral is split along its shorter diagonal.
    fn trapezium(&mut self, [a, b, c]: [u32; 3], out: &mut Vec<[u32; 3]>) {
        let (ab, ac) = (self.at(a, b), self.at(a, c));
        let p = |v: u32| self.mesh.positions[v as usize];
        if (p(ab) - p(c)).norm() < (p(ac) - p(b)).norm() {
            out.extend([[ab, b, c], [ab, c, ac]]);
        } else {
            out.extend([[ab, b, ac], [b, c, ac]]);
        }
    }

    /// The vertex where the zero line crosses the edge.
    fn at(&mut self, i: u32, j: u32) -> u32 {
        let key = [i.min(j), i.max(j)];
        if let Some(&v) = self.between.get(&key) {
            return v;
        }
        let [a, b] = key.map(|v| v as usize);
        let (fa, fb) = (self.field[a], self.field[b]);
        let t = (fa / (fa - fb)).clamp(AWAY_FROM_ENDS, 1.0 - AWAY_FROM_ENDS);
        let v = self.mesh.positions.len() as u32;
        push_between(&mut self.mesh, a, b, t);
        self.between.insert(key, v);
        v
    }
}

/// Appends the vertex at share `t` from vertex `a` to vertex `b`.
fn push_between(mesh: &mut Mesh, a: usize, b: usize, t: f32) {
    let p = mesh.positions[a] + (mesh.positions[b] - mesh.positions[a]) * t;
    mesh.positions.push(p);
    if !mesh.normals.is_empty() {
        let n = (mesh.normals[a] * (1.0 - t) + mesh.normals[b] * t).try_normalize(1e-12).unwrap_or(mesh.normals[a]);
        mesh.normals.push(n);
    }
    if !mesh.colors.is_empty() {
        let (x, y) = (mesh.colors[a], mesh.colors[b]);
        let mix = |k: usize| (f32::from(x[k]) * (1.0 - t) + f32::from(y[k]) * t).round() as u8;
        mesh.colors.push([mix(0), mix(1), mix(2)]);
    }
    for values in mesh.attributes.values_mut() {
        values.push(values[a] * (1.0 - t) + values[b] * t);
    }
}

#[cfg(test)]
mod tests {
    use toile_geometry::topology::{boundary_loops, loop_length};

    use super::*;

    /// A flat grid of n × n squares of 10 mm, with x as attribute.
    fn sheet(n: u32) -> Mesh {
        let at = |i: u32, j: u32| i * (n + 1) + j;
        let positions: Vec<Point3<f32>> =
            (0..=n).flat_map(|i| (0..=n).map(move |j| Point3::new(i as f32 * 0.01, j as f32 * 0.01, 0.0))).collect();
        let triangles = (0..n)
            .flat_map(|i| (0..n).map(move |j| (i, j)))
            .flat_map(|(i, j)| {
                let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                [[a, b, c], [a, c, d]]
            })
            .collect();
        let mut mesh = Mesh::new(positions, triangles);
        mesh.attributes.insert("x".into(), mesh.positions.iter().map(|p| p.x).collect());
        mesh
    }

    #[test]
    fn a_disk_is_cut_round_and_attributes_follow() {
        let mesh = sheet(40);
        let center = Point3::new(0.2, 0.2, 0.0);
        let field: Vec<f32> = mesh.positions.iter().map(|p| 0.1 - (p - center).norm()).collect();
        let disk = cut_positive(&mesh, &field);
        assert!((disk.area() - std::f64::consts::PI * 0.01).abs() < 2e-4, "{}", disk.area());
        let loops = boundary_loops(&disk.triangles);
        assert_eq!(loops.len(), 1);
        assert!((loop_length(&disk.positions, &loops[0]) - 0.628).abs() < 0.01);
        assert!(disk.positions.iter().zip(&disk.attributes["x"]).all(|(p, x)| (p.x - x).abs() < 1e-6));
        disk.validate().unwrap();
    }

    #[test]
    fn smoothing_takes_the_stairs_off() {
        let mesh = sheet(40);
        let graph = ScanGraph::new(&mesh);
        let inside: Vec<bool> = mesh.positions.iter().map(|p| p.x + 0.5 * p.y < 0.27).collect();
        let length_of = |field: &[f32]| {
            let cut = cut_positive(&mesh, field);
            loop_length(&cut.positions, &boundary_loops(&cut.triangles)[0])
        };
        let hard: Vec<f32> = inside.iter().map(|&i| if i { 1.0 } else { -1.0 }).collect();
        let soft = smooth_field(&graph, &mesh.positions, &inside, 0.02);
        assert!(length_of(&soft) < length_of(&hard) - 0.01);
    }
}
