//! Closing holes by fair patches: a triangulation with minimum area, refined to the surroundings' density and relaxed to
//! a thin plate (after Liepa 2003, "Filling holes in meshes").

use std::collections::BTreeSet;

use nalgebra::Point3;
use rayon::prelude::*;

use crate::{
    Mesh, polygon,
    topology::{VertexTriangles, boundary_loops, loop_length},
};

mod patch;
mod relax;

use patch::Patch;

/// Name of the vertex attribute that is 1 where a patch was put in.
pub const FILLED: &str = "filled";

/// A plate with more than this many times the membrane's area bulges too far over the hole and is not used.
const MAX_BULGE: f64 = 1.2;

/// Holes that were closed and left open.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Filled {
    /// Holes closed.
    pub holes: usize,
    /// Length of the longest closed border, metres.
    pub longest: f32,
    /// Borders left open because no triangulation was found.
    pub left_open: usize,
}

/// Closes every hole whose border is at most `max_length` long (metres) by a thin plate that continues the
/// surroundings, or, where that would bulge, by a taut membrane. New vertices get the attribute [`FILLED`] = 1 (old
/// ones 0), and colours and attributes that run on smoothly from the border. The mesh must be a manifold
/// ([`crate::components::make_manifold`]). Normals are recomputed where there were any.
pub fn fill_holes(mesh: &Mesh, max_length: f32) -> (Mesh, Filled) {
    fill_where(mesh, |border| loop_length(&mesh.positions, border) <= max_length)
}

/// As [`fill_holes`], for the holes for whose border `wanted` holds.
pub(crate) fn fill_where(mesh: &Mesh, wanted: impl Fn(&[u32]) -> bool + Sync) -> (Mesh, Filled) {
    let mut out = mesh.clone();
    out.attributes.entry(FILLED.into()).or_insert_with(|| vec![0.0; mesh.positions.len()]);
    let loops: Vec<Vec<u32>> =
        boundary_loops(&mesh.triangles).into_iter().flat_map(split_at_repeats).filter(|l| l.len() > 2).collect();
    let taken = border_edges(mesh, &loops);
    let around = VertexTriangles::new(mesh.positions.len(), &mesh.triangles);
    let mut filled = Filled::default();
    let patches: Vec<(Vec<u32>, Option<Patch>)> =
        loops.par_iter().filter(|l| wanted(l)).map(|l| close(mesh, &around, l, &taken)).collect();
    for (border, patch) in patches {
        match patch {
            Some(patch) => {
                append(&mut out, &border, &patch);
                filled.holes += 1;
                filled.longest = filled.longest.max(loop_length(&mesh.positions, &border));
            }
            None => filled.left_open += 1,
        }
    }
    if !mesh.normals.is_empty() {
        out.recompute_normals();
    }
    (out, filled)
}

/// The border in the patch's direction and its patch, if there is one.
fn close(
    mesh: &Mesh,
    around: &VertexTriangles,
    border: &[u32],
    taken: &BTreeSet<(u32, u32)>,
) -> (Vec<u32>, Option<Patch>) {
    // The patch's triangles run against the border's own direction.
    let reversed: Vec<u32> = border.iter().rev().copied().collect();
    let points: Vec<Point3<f64>> = reversed.iter().map(|&v| mesh.positions[v as usize].cast()).collect();
    let blocked = |i: usize, k: usize| taken.contains(&ordered(reversed[i], reversed[k]));
    let patch = polygon::triangulate(&points, &blocked).map(|triangles| {
        let mut patch = Patch::new(points, triangles);
        patch.refine(&blocked);
        patch.tighten();
        let membrane = patch.clone();
        relax::relax(&mut patch, mesh, around, &reversed);
        if patch.area() > MAX_BULGE * membrane.area() {
            patch = membrane;
        }
        patch
    });
    (reversed, patch)
}

/// Cuts a cycle that meets itself into simple ones.
fn split_at_repeats(cycle: Vec<u32>) -> Vec<Vec<u32>> {
    let (mut out, mut path): (Vec<Vec<u32>>, Vec<u32>) = (Vec::new(), Vec::new());
    for v in cycle {
        if let Some(at) = path.iter().position(|&p| p == v) {
            out.push(path.split_off(at));
        }
        path.push(v);
    }
    out.push(path);
    out
}

/// Mesh edges between border vertices: a patch must not use them again.
fn border_edges(mesh: &Mesh, loops: &[Vec<u32>]) -> BTreeSet<(u32, u32)> {
    let mut on_border = vec![false; mesh.positions.len()];
    loops.iter().flatten().for_each(|&v| on_border[v as usize] = true);
    let sides = mesh.triangles.iter().flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]);
    sides.filter(|s| on_border[s.0 as usize] && on_border[s.1 as usize]).map(|s| ordered(s.0, s.1)).collect()
}

fn ordered(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}

/// Adds a patch whose first vertices are the border's.
fn append(mesh: &mut Mesh, border: &[u32], patch: &Patch) {
    let first = mesh.positions.len() as u32;
    let inner = patch.positions.len() - border.len();
    mesh.positions.extend(patch.positions[border.len()..].iter().map(|p| p.cast::<f32>()));
    if !mesh.normals.is_empty() {
        mesh.normals.resize(mesh.positions.len(), nalgebra::Vector3::zeros());
    }
    let weights = relax::border_weights(patch, border.len());
    let blend = |values: &dyn Fn(u32) -> f64, row: &[(u32, f64)]| -> f64 {
        row.iter().map(|&(k, w)| w * values(border[k as usize])).sum()
    };
    for row in weights.iter().take(inner) {
        if !mesh.colors.is_empty() {
            let color =
                |k: usize| blend(&|v| f64::from(mesh.colors[v as usize][k]), row).round().clamp(0.0, 255.0) as u8;
            let mixed = [color(0), color(1), color(2)];
            mesh.colors.push(mixed);
        }
        for (name, values) in &mut mesh.attributes {
            let value = if name == FILLED { 1.0 } else { blend(&|v| f64::from(values[v as usize]), row) as f32 };
            values.push(value);
        }
    }
    let index = |v: u32| if (v as usize) < border.len() { border[v as usize] } else { first + v - border.len() as u32 };
    mesh.triangles.extend(patch.triangles.iter().map(|t| t.map(index)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topology::Edges;

    /// A unit sphere of `n` by 2n cells without its cap above `top`.
    fn open_sphere(n: usize, rows: std::ops::Range<usize>) -> Mesh {
        let mut mesh = Mesh::default();
        let m = 2 * n;
        for i in rows.clone() {
            for j in 0..m {
                let (a, b) = (std::f32::consts::PI * i as f32 / n as f32, std::f32::consts::PI * j as f32 / n as f32);
                mesh.positions.push(Point3::new(a.sin() * b.cos(), a.cos(), a.sin() * b.sin()));
                mesh.colors.push([200, 100, 50]);
            }
        }
        let at = |i: usize, j: usize| (i * m + j % m) as u32;
        for i in 0..rows.len() - 1 {
            for j in 0..m {
                mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i + 1, j)]);
                mesh.triangles.push([at(i, j), at(i, j + 1), at(i + 1, j + 1)]);
            }
        }
        mesh
    }

    #[test]
    fn two_caps_close_fair_and_outward() {
        let mesh = open_sphere(40, 6..36);
        let (closed, filled) = fill_holes(&mesh, f32::INFINITY);
        assert_eq!((filled.holes, filled.left_open), (2, 0));
        assert!(Edges::new(&closed.triangles).is_closed());
        closed.validate().unwrap();
        let volume = 4.0 / 3.0 * std::f64::consts::PI;
        assert!((closed.signed_volume() - volume).abs() < 0.02 * volume, "{}", closed.signed_volume());
        for (v, p) in closed.positions.iter().enumerate().filter(|(v, _)| closed.attributes[FILLED][*v] == 1.0) {
            assert!((p.coords.norm() - 1.0).abs() < 0.05, "vertex {v} at {p}");
            assert_eq!(closed.colors[v], [200, 100, 50]);
        }
        assert!(closed.attributes[FILLED].iter().filter(|&&f| f == 1.0).count() > 50);
    }

    #[test]
    fn long_borders_stay_open_when_asked() {
        let mesh = open_sphere(20, 2..12);
        let (kept, filled) = fill_holes(&mesh, 3.0);
        assert_eq!(filled.holes, 1);
        assert_eq!(boundary_loops(&kept.triangles).len(), 1);
    }

    /// The plate over a tube's end would be a dome: a skirt's hem is closed flat.
    #[test]
    fn a_tube_is_closed_flat() {
        let mut mesh = open_sphere(40, 10..31);
        for p in &mut mesh.positions {
            let radius = p.x.hypot(p.z);
            (p.x, p.z) = (p.x / radius, p.z / radius);
        }
        let (low, high) = mesh.bounds().unwrap();
        let (closed, filled) = fill_holes(&mesh, f32::INFINITY);
        assert_eq!(filled.holes, 2);
        for p in &closed.positions {
            assert!(p.y > low.y - 0.02 && p.y < high.y + 0.02, "{p} is not between {low} and {high}");
        }
    }
}
