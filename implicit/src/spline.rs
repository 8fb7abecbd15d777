//! The skin: contour points as control points of cubic B-spline patches (paper 002 §3.2).
//!
//! Pieces of skin meet in corners where no patch is rectangular. Catmull and Clark's subdivision (1978) is the bicubic
//! uniform B-spline on every regular part of the mesh of contours, and goes on smoothly over such corners, so that all pieces
//! are one patchwork without a gap. Each patch is triangulated 2 × 2, its corners lie on the limit surface.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

/// A point of the skin as a weighted sum of control points.
type Stencil = Vec<(u32, f32)>;

/// The rows of all stencils, one after another.
#[derive(Debug, Clone, Default)]
struct Stencils {
    starts: Vec<u32>,
    entries: Vec<(u32, f32)>,
}

/// Patches over a mesh of quadrilaterals.
#[derive(Debug, Clone)]
pub struct Patches {
    /// Triangles of the skin, outward: corners of patches first, then middles of edges, then middles of patches.
    pub triangles: Vec<[u32; 3]>,
    skin: Stencils,
    /// For each control point, the skin point over it.
    over_control: usize,
}

/// How the skin relates to the sampled points.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Through {
    /// Sampled points are the control points, as in the paper: the skin stays a little inside of them.
    Control,
    /// Control points are moved first, so that the skin passes the sampled points nearly exactly.
    #[default]
    Points,
}

impl Patches {
    /// Patches over `quads` on `count` control points.
    pub fn new(count: usize, quads: &[[u32; 4]]) -> Self {
        let mut edges: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
        for (f, quad) in quads.iter().enumerate() {
            for k in 0..4 {
                edges.entry(key(quad[k], quad[(k + 1) % 4])).or_default().push(f as u32);
            }
        }
        let index: BTreeMap<[u32; 2], u32> = edges.keys().enumerate().map(|(k, e)| (*e, (count + k) as u32)).collect();
        let mut stencils = corner_stencils(count, quads, &edges);
        stencils.extend(edges.iter().map(|(edge, faces)| edge_stencil(*edge, faces, quads)));
        stencils.extend(quads.iter().map(|quad| quad.iter().map(|&v| (v, 0.25)).collect()));
        let mut triangles = Vec::with_capacity(8 * quads.len());
        for (f, quad) in quads.iter().enumerate() {
            let middle = (count + edges.len() + f) as u32;
            for k in 0..4 {
                let (next, last) = (index[&key(quad[k], quad[(k + 1) % 4])], index[&key(quad[k], quad[(k + 3) % 4])]);
                triangles.push([quad[k], next, middle]);
                triangles.push([quad[k], middle, last]);
            }
        }
        Self { triangles, skin: limit(count, quads, &edges, &stencils), over_control: count }
    }

    /// Number of points of the skin.
    pub fn len(&self) -> usize {
        self.skin.starts.len() - 1
    }

    /// Whether there is no skin.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The points of the skin for `control` points.
    pub fn skin(&self, control: &[Point3<f64>], through: Through) -> Vec<Point3<f32>> {
        let control: Vec<Vector3<f32>> = control[..self.over_control].iter().map(|p| p.coords.cast::<f32>()).collect();
        match through {
            Through::Control => (0..self.len()).map(|k| self.skin.at(k, &control)).collect(),
            Through::Points => {
                let mut moved = control.clone();
                // each turn takes away most of what the last one left; two leave less than a tenth of a millimetre
                for _ in 0..2 {
                    let next: Vec<Vector3<f32>> =
                        (0..control.len()).map(|k| moved[k] + (control[k] - self.skin.at(k, &moved).coords)).collect();
                    moved = next;
                }
                (0..self.len()).map(|k| self.skin.at(k, &moved)).collect()
            }
        }
    }

    /// The open edges of the skin along an open contour of control points, in order: its corners and the middles of its edges.
    pub fn rim(&self, contour: &[u32], quads: &[[u32; 4]]) -> Vec<u32> {
        let mut middles: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        for (f, quad) in quads.iter().enumerate() {
            for k in 0..4 {
                middles.insert(key(quad[k], quad[(k + 1) % 4]), self.triangles[8 * f + 2 * k][1]);
            }
        }
        let pairs = contour.iter().zip(contour.iter().cycle().skip(1));
        pairs.flat_map(|(&a, &b)| std::iter::once(a).chain(middles.get(&key(a, b)).copied())).collect()
    }
}

impl Stencils {
    fn push(&mut self, stencil: &Stencil) {
        if self.starts.is_empty() {
            self.starts.push(0);
        }
        self.entries.extend_from_slice(stencil);
        self.starts.push(self.entries.len() as u32);
    }

    fn at(&self, k: usize, control: &[Vector3<f32>]) -> Point3<f32> {
        let entries = &self.entries[self.starts[k] as usize..self.starts[k + 1] as usize];
        Point3::from(entries.iter().map(|(v, w)| control[*v as usize] * *w).sum::<Vector3<f32>>())
    }
}

fn key(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Control points after one subdivision: (F + 2E + (n − 3)P) / n inside, 1-6-1 on an open edge.
fn corner_stencils(count: usize, quads: &[[u32; 4]], edges: &BTreeMap<[u32; 2], Vec<u32>>) -> Vec<Stencil> {
    let mut sums: Vec<BTreeMap<u32, f32>> = vec![BTreeMap::new(); count];
    let rings = Rings::new(count, quads, edges);
    for (v, sum) in sums.iter_mut().enumerate() {
        let mut add = |u: u32, w: f32| *sum.entry(u).or_default() += w;
        let n = rings.edges[v].len() as f32;
        if let [a, b] = rings.open[v][..] {
            [(v as u32, 0.75), (a, 0.125), (b, 0.125)].into_iter().for_each(|(u, w)| add(u, w));
        } else if n > 0.0 {
            for &f in &rings.faces[v] {
                quads[f as usize].iter().for_each(|&u| add(u, 0.25 / (n * n)));
            }
            for &u in &rings.edges[v] {
                add(u, 1.0 / (n * n));
                add(v as u32, 1.0 / (n * n));
            }
            add(v as u32, (n - 3.0) / n);
        } else {
            add(v as u32, 1.0);
        }
    }
    sums.into_iter().map(|s| s.into_iter().collect()).collect()
}

/// The middle of an edge after one subdivision.
fn edge_stencil(edge: [u32; 2], faces: &[u32], quads: &[[u32; 4]]) -> Stencil {
    let mut sum: BTreeMap<u32, f32> = BTreeMap::new();
    let own = if faces.len() == 2 { 0.25 } else { 0.5 };
    edge.iter().for_each(|&v| *sum.entry(v).or_default() += own);
    if faces.len() == 2 {
        for &f in faces {
            quads[f as usize].iter().for_each(|&v| *sum.entry(v).or_default() += 0.0625);
        }
    }
    sum.into_iter().collect()
}

/// Neighbours of each control point.
struct Rings {
    faces: Vec<Vec<u32>>,
    edges: Vec<Vec<u32>>,
    /// Neighbours along open edges.
    open: Vec<Vec<u32>>,
}

impl Rings {
    fn new(count: usize, quads: &[[u32; 4]], edges: &BTreeMap<[u32; 2], Vec<u32>>) -> Self {
        let mut rings =
            Self { faces: vec![Vec::new(); count], edges: vec![Vec::new(); count], open: vec![Vec::new(); count] };
        for (f, quad) in quads.iter().enumerate() {
            quad.iter().for_each(|&v| rings.faces[v as usize].push(f as u32));
        }
        for (&[a, b], faces) in edges {
            for (u, v) in [(a, b), (b, a)] {
                rings.edges[u as usize].push(v);
                if faces.len() == 1 {
                    rings.open[u as usize].push(v);
                }
            }
        }
        rings
    }
}

/// Stencils that put all points of the subdivided mesh onto the limit surface, in terms of the control points: of valence n,
/// (n² P + 4 Σ E + Σ F) / (n (n + 5)) over its neighbours in the subdivided mesh; 1-4-1 on an open edge.
fn limit(count: usize, quads: &[[u32; 4]], edges: &BTreeMap<[u32; 2], Vec<u32>>, stencils: &[Stencil]) -> Stencils {
    let middles: BTreeMap<[u32; 2], u32> = edges.keys().enumerate().map(|(k, e)| (*e, (count + k) as u32)).collect();
    let mut fine: Vec<[u32; 4]> = Vec::with_capacity(4 * quads.len());
    for (f, quad) in quads.iter().enumerate() {
        for k in 0..4 {
            let [next, last] = [1, 3].map(|d| middles[&key(quad[k], quad[(k + d) % 4])]);
            fine.push([quad[k], next, (count + edges.len() + f) as u32, last]);
        }
    }
    let mut fine_edges: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
    for (f, quad) in fine.iter().enumerate() {
        (0..4).for_each(|k| fine_edges.entry(key(quad[k], quad[(k + 1) % 4])).or_default().push(f as u32));
    }
    let rings = Rings::new(stencils.len(), &fine, &fine_edges);
    let mut out = Stencils::default();
    for v in 0..stencils.len() {
        let mut sum: BTreeMap<u32, f32> = BTreeMap::new();
        let mut add =
            |u: u32, w: f32| stencils[u as usize].iter().for_each(|(c, x)| *sum.entry(*c).or_default() += x * w);
        let n = rings.edges[v].len() as f32;
        if let [a, b] = rings.open[v][..] {
            [(v as u32, 2.0 / 3.0), (a, 1.0 / 6.0), (b, 1.0 / 6.0)].into_iter().for_each(|(u, w)| add(u, w));
        } else if n > 0.0 {
            let scale = 1.0 / (n * (n + 5.0));
            add(v as u32, n * n * scale);
            rings.edges[v].iter().for_each(|&u| add(u, 4.0 * scale));
            for &f in &rings.faces[v] {
                let quad = fine[f as usize];
                let opposite = quad.iter().position(|&u| u as usize == v).map_or(v as u32, |k| quad[(k + 2) % 4]);
                add(opposite, scale);
            }
        } else {
            add(v as u32, 1.0);
        }
        out.push(&sum.into_iter().collect());
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A regular grid with its heights.
    fn grid(size: u32, height: impl Fn(f64, f64) -> f64) -> (Vec<Point3<f64>>, Vec<[u32; 4]>) {
        let at = |x: u32, y: u32| y * size + x;
        let points = (0..size * size).map(|k| {
            let (x, y) = (f64::from(k % size), f64::from(k / size));
            Point3::new(x, y, height(x, y))
        });
        let quads = (0..(size - 1) * (size - 1)).map(|k| {
            let (x, y) = (k % (size - 1), k / (size - 1));
            [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)]
        });
        (points.collect(), quads.collect())
    }

    #[test]
    fn inside_a_grid_the_skin_is_the_bicubic_b_spline() {
        let (points, quads) = grid(7, |x, y| (1.3 * x).sin() + 0.7 * x * (0.9 * y).cos());
        let patches = Patches::new(points.len(), &quads);
        let skin = patches.skin(&points, Through::Control);
        let spline = |t: f64| {
            [
                (1.0 - t).powi(3),
                3.0 * t.powi(3) - 6.0 * t * t + 4.0,
                -3.0 * t.powi(3) + 3.0 * t * t + 3.0 * t + 1.0,
                t.powi(3),
            ]
            .map(|b| b / 6.0)
        };
        let value = |x: f64, y: f64| -> f64 {
            let (i, j) = (x.floor(), y.floor());
            let (bx, by) = (spline(x - i), spline(y - j));
            let control = |a: usize, b: usize| points[(j as usize + b - 1) * 7 + i as usize + a - 1].z;
            (0..4).flat_map(|a| (0..4).map(move |b| (a, b))).map(|(a, b)| bx[a] * by[b] * control(a, b)).sum()
        };
        let inside = skin.iter().filter(|p| p.x > 1.9 && p.x < 4.1 && p.y > 1.9 && p.y < 4.1);
        let mut count = 0;
        for p in inside {
            let expected = value(f64::from(p.x) + 1e-9, f64::from(p.y) + 1e-9);
            assert!((f64::from(p.z) - expected).abs() < 1e-5, "{p}: {expected}");
            count += 1;
        }
        assert_eq!(count, 25);
    }

    #[test]
    fn the_skin_passes_the_points_where_it_is_asked_to() {
        let (points, quads) = grid(9, |x, y| 0.2 * (0.8 * x).sin() * (0.8 * y).cos());
        let patches = Patches::new(points.len(), &quads);
        let off = |through| {
            let skin = patches.skin(&points, through);
            points.iter().zip(&skin).map(|(a, b)| (a.cast::<f32>() - b).norm()).fold(0.0, f32::max)
        };
        assert!(off(Through::Points) < 0.2 * off(Through::Control), "{}", off(Through::Points));
    }

    #[test]
    fn a_closed_mesh_of_quadrilaterals_gets_a_closed_skin() {
        let corners = (0..8u32).map(|i| Point3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2 & 1)));
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let patches = Patches::new(8, &quads);
        assert!(toile_geometry::topology::Edges::new(&patches.triangles).is_closed());
        let skin = patches.skin(&corners.collect::<Vec<_>>(), Through::Control);
        let mesh = toile_geometry::Mesh::new(skin, patches.triangles);
        assert!(mesh.signed_volume() > 0.2 && mesh.signed_volume() < 1.0);
    }
}
