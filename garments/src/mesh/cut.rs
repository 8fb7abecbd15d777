//! A draft cut along the zero line of a vertex field, through its triangles.

use std::collections::BTreeMap;

use super::draft::Draft;
use crate::measure::scan_graph::ScanGraph;

/// Cut points keep this share of an edge away from its ends, so that no sliver has an edge of no length.
const AWAY_FROM_ENDS: f32 = 0.06;
/// Limit of the smoothing steps.
const MAX_STEPS: f32 = 200.0;

/// Signed field of a label: +1 inside, −1 outside, diffused over the surface with standard deviation `deviation`
/// (metres), so that its zero line is the labels' border with the corners taken off.
pub(super) fn smooth_field(graph: &ScanGraph, inside: &[bool], deviation: f32) -> Vec<f32> {
    let length = |&[i, j]: &[u32; 2]| graph.step(j as usize, i as usize);
    let squares: f64 = graph.edges.iter().map(|e| f64::from(length(e).powi(2))).sum();
    let mean_square = (squares / graph.edges.len().max(1) as f64) as f32;
    // Moving half of the value by one edge adds a quarter of the edge's square to the variance along each direction.
    let steps = (4.0 * deviation * deviation / mean_square.max(1e-9)).ceil().min(MAX_STEPS) as usize;
    let weight = |(e, dual): (&[u32; 2], &f32)| (dual / length(e).max(1e-6)).max(0.05);
    let weights: Vec<f32> = graph.edges.iter().zip(&graph.dual_lengths).map(weight).collect();
    let mut field: Vec<f32> = inside.iter().map(|&i| if i { 1.0 } else { -1.0 }).collect();
    for _ in 0..steps {
        diffuse(&mut field, &graph.edges, &weights);
    }
    field
}

/// Moves every value half-way to the weighted mean of its neighbours.
fn diffuse(field: &mut [f32], edges: &[[u32; 2]], weights: &[f32]) {
    let mut sums = vec![[0.0f32; 2]; field.len()];
    for (&[i, j], &w) in edges.iter().zip(weights) {
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

/// The part of a draft where `field` is positive. Triangles that the zero line crosses are split; new vertices carry
/// interpolated colours, normals and channels.
pub(super) fn cut_positive(draft: Draft, field: &[f32]) -> Draft {
    let inside = |v: u32| field[v as usize] > 0.0;
    let mut cuts = Cuts { draft, field, between: BTreeMap::new() };
    let mut triangles = Vec::new();
    for [a, b, c] in std::mem::take(&mut cuts.draft.surface.triangles) {
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
    let mut all = cuts.draft;
    all.surface.triangles = triangles;
    all.filter(|_| true)
}

struct Cuts<'a> {
    draft: Draft,
    field: &'a [f32],
    /// The new vertex of each edge that was cut.
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
        let p = |v: u32| self.draft.surface.positions[v as usize];
        if (p(ab) - p(c)).norm() < (p(ac) - p(b)).norm() {
            out.extend([[ab, b, c], [ab, c, ac]]);
        } else {
            out.extend([[ab, b, ac], [b, c, ac]]);
        }
    }

    /// The vertex where the zero line crosses the edge.
    fn at(&mut self, i: u32, j: u32) -> u32 {
        let key = [i.min(j), i.max(j)];
        let (draft, field) = (&mut self.draft, self.field);
        *self.between.entry(key).or_insert_with(|| {
            let [a, b] = key.map(|v| v as usize);
            let (fa, fb) = (field[a], field[b]);
            draft.push_between(a, b, (fa / (fa - fb)).clamp(AWAY_FROM_ENDS, 1.0 - AWAY_FROM_ENDS))
        })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;
    use toile_geometry::{
        Mesh,
        topology::{boundary_loops, loop_length},
    };

    use super::*;
    use crate::mesh::draft::Channel;

    /// A flat grid of n × n squares of 10 mm.
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
        Mesh::new(positions, triangles)
    }

    #[test]
    fn a_disk_is_cut_round_and_channels_follow() {
        let mesh = sheet(40);
        let center = Point3::new(0.2, 0.2, 0.0);
        let field: Vec<f32> = mesh.positions.iter().map(|p| 0.1 - (p - center).norm()).collect();
        let mut draft = Draft::of(&mesh);
        draft.channels[Channel::Clearance] = mesh.positions.iter().map(|p| p.x).collect();
        let cut = cut_positive(draft, &field);
        let disk = &cut.surface;
        assert!((disk.area() - std::f64::consts::PI * 0.01).abs() < 2e-4, "{}", disk.area());
        let loops = boundary_loops(&disk.triangles);
        assert_eq!(loops.len(), 1);
        assert!((loop_length(&disk.positions, &loops[0]) - 0.628).abs() < 0.01);
        assert!(disk.positions.iter().zip(&cut.channels[Channel::Clearance]).all(|(p, x)| (p.x - x).abs() < 1e-6));
        disk.validate().unwrap();
    }

    #[test]
    fn smoothing_takes_the_stairs_off() {
        let mesh = sheet(40);
        let graph = ScanGraph::new(&mesh);
        let inside: Vec<bool> = mesh.positions.iter().map(|p| p.x + 0.5 * p.y < 0.27).collect();
        let length_of = |field: &[f32]| {
            let cut = cut_positive(Draft::of(&mesh), field).surface;
            loop_length(&cut.positions, &boundary_loops(&cut.triangles)[0])
        };
        let hard: Vec<f32> = inside.iter().map(|&i| if i { 1.0 } else { -1.0 }).collect();
        let soft = smooth_field(&graph, &inside, 0.02);
        assert!(length_of(&soft) < length_of(&hard) - 0.01);
    }
}
