//! Relaxing a patch to a thin plate that continues its surroundings, and smooth continuation of border values.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Point3, Vector3};

use super::patch::Patch;
use crate::{
    Mesh,
    laplacian::{Row, cotangent_laplacian},
    topology::VertexTriangles,
    triangle::double_area,
};

/// Rings of the surroundings that the plate continues.
const RINGS: usize = 2;
/// Maximum number of conjugate-gradient steps.
const STEPS: usize = 600;
/// Maximum number of border vertices that give an inner vertex its colour.
const NEAREST: usize = 12;

/// The patch, its border and the rings of mesh around, as one system.
struct Plate {
    positions: Vec<Vector3<f64>>,
    /// For each row (patch vertex, border included): neighbours with weights.
    rows: Vec<Vec<(u32, f64)>>,
    free: Vec<bool>,
}

/// Moves the inner vertices so that the area-weighted square of the cotangent Laplacian over patch and border is
/// minimal, with the rings of mesh around the hole held: a thin plate that runs on without a crease.
pub(super) fn relax(patch: &mut Patch, mesh: &Mesh, around: &VertexTriangles, border: &[u32]) {
    if patch.positions.len() == patch.border {
        return;
    }
    let plate = surroundings(patch, mesh, around, border);
    let laplacian = |x: &[Vector3<f64>], out: &mut Vec<Vector3<f64>>| {
        out.clear();
        let row = |(v, row): (usize, &Vec<(u32, f64)>)| {
            row.iter().map(|&(n, w)| (x[n as usize] - x[v]) * w).sum::<Vector3<f64>>()
        };
        out.extend(plate.rows.iter().enumerate().map(row));
    };
    let transposed = |y: &[Vector3<f64>], out: &mut [Vector3<f64>]| {
        out.iter_mut().for_each(|o| *o = Vector3::zeros());
        for (v, row) in plate.rows.iter().enumerate() {
            for &(n, w) in row {
                out[n as usize] += y[v] * w;
                out[v] -= y[v] * w;
            }
        }
        out.iter_mut().zip(&plate.free).filter(|(_, f)| !**f).for_each(|(o, _)| *o = Vector3::zeros());
    };
    let solution = least_squares(plate.positions.clone(), laplacian, transposed);
    for (position, solved) in patch.positions.iter_mut().zip(&solution).skip(patch.border) {
        *position = Point3::from(*solved);
    }
}

/// Positions, Laplacian rows and freedom of the patch followed by the rings around it.
fn surroundings(patch: &Patch, mesh: &Mesh, around: &VertexTriangles, border: &[u32]) -> Plate {
    let mut number: BTreeMap<u32, u32> = border.iter().enumerate().map(|(k, &v)| (v, k as u32)).collect();
    let mut positions: Vec<Vector3<f64>> = patch.positions.iter().map(|p| p.coords).collect();
    let mut triangles = patch.triangles.clone();
    let mut used = BTreeSet::new();
    let mut front: Vec<u32> = border.to_vec();
    for _ in 0..RINGS {
        let mut next = Vec::new();
        for &v in &front {
            for &t in around.of(v as usize) {
                if !used.insert(t) {
                    continue;
                }
                let corners = mesh.triangles[t as usize].map(|c| {
                    *number.entry(c).or_insert_with(|| {
                        next.push(c);
                        positions.push(mesh.positions[c as usize].coords.cast());
                        positions.len() as u32 - 1
                    })
                });
                triangles.push(corners);
            }
        }
        front = next;
    }
    let free = (0..positions.len()).map(|v| v >= patch.border && v < patch.positions.len()).collect();
    let rows = laplacian_rows(&positions, &triangles, patch.positions.len());
    Plate { positions, rows, free }
}

/// Cotangent weights over the square root of each vertex' area, for the first `count` vertices.
fn laplacian_rows(positions: &[Vector3<f64>], triangles: &[[u32; 3]], count: usize) -> Vec<Vec<(u32, f64)>> {
    let mut doubled: Vec<f64> = triangles.iter().map(|t| double_area(t.map(|v| positions[v as usize]))).collect();
    let mean = doubled.iter().sum::<f64>() / triangles.len().max(1) as f64;
    let least = mean * 1e-3;
    doubled.iter_mut().for_each(|d| *d = d.max(least));
    let half_cotangent = |t: usize, k: usize| {
        let [a, b, c] = [k, k + 1, k + 2].map(|k| positions[triangles[t][k % 3] as usize]);
        0.5 * ((b - a).dot(&(c - a)) / doubled[t]).clamp(0.05, 20.0)
    };
    let mut areas = vec![0.0; count];
    for (t, d) in triangles.iter().zip(&doubled) {
        t.iter().filter(|&&v| (v as usize) < count).for_each(|&v| areas[v as usize] += d / 6.0);
    }
    let scaled = |(v, row): (usize, Row)| {
        let scale = (mean / areas[v].max(least)).sqrt();
        row.into_iter().filter(|e| e.0 as usize != v).map(|(n, c)| (n, -c * scale)).collect()
    };
    cotangent_laplacian(triangles, count, half_cotangent).into_iter().enumerate().map(scaled).collect()
}

/// Conjugate gradients on the normal equations of L x = 0 over the free entries.
fn least_squares(
    mut x: Vec<Vector3<f64>>,
    apply: impl Fn(&[Vector3<f64>], &mut Vec<Vector3<f64>>),
    transposed: impl Fn(&[Vector3<f64>], &mut [Vector3<f64>]),
) -> Vec<Vector3<f64>> {
    let dot = |a: &[Vector3<f64>], b: &[Vector3<f64>]| a.iter().zip(b).map(|(p, q)| p.dot(q)).sum::<f64>();
    let mut image = Vec::new();
    let mut residual = vec![Vector3::zeros(); x.len()];
    apply(&x, &mut image);
    transposed(&image, &mut residual);
    residual.iter_mut().for_each(|r| *r = -*r);
    let mut direction = residual.clone();
    let mut gain = vec![Vector3::zeros(); x.len()];
    let mut size = dot(&residual, &residual);
    let enough = size * 1e-10;
    for _ in 0..STEPS {
        if size <= enough.max(1e-24) {
            break;
        }
        apply(&direction, &mut image);
        transposed(&image, &mut gain);
        let along = dot(&direction, &gain);
        if along <= 0.0 {
            break;
        }
        let alpha = size / along;
        x.iter_mut().zip(&direction).for_each(|(x, d)| *x += d * alpha);
        residual.iter_mut().zip(&gain).for_each(|(r, g)| *r -= g * alpha);
        let before = std::mem::replace(&mut size, dot(&residual, &residual));
        let beta = size / before;
        direction.iter_mut().zip(&residual).for_each(|(d, r)| *d = r + *d * beta);
    }
    x
}

/// For every inner vertex the weights (sum 1) of the border vertices: inverse square distances to the nearest ones.
pub(super) fn border_weights(patch: &Patch, border: usize) -> Vec<Vec<(u32, f64)>> {
    let row = |p: &Point3<f64>| {
        let distances = patch.positions[..border].iter().map(|q| (p - q).norm_squared());
        let mut nearest: Vec<(f64, u32)> = distances.zip(0..).collect();
        if NEAREST < border {
            nearest.select_nth_unstable_by(NEAREST, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            nearest.truncate(NEAREST);
            nearest.sort_unstable_by_key(|n| n.1);
        }
        let sum: f64 = nearest.iter().map(|n| 1.0 / (n.0 + 1e-9)).sum();
        // Collecting from the vector itself would keep room for the whole border in every row.
        nearest.iter().map(|&(d, k)| (k, 1.0 / (d + 1e-9) / sum)).collect()
    };
    patch.positions[border..].iter().map(row).collect()
}
