//! The rim of a cut garment: grown by what the sensor loses at a free edge, and smoothed along.
//!
//! Where nothing lies close behind a hem, a depth camera's outermost pixels are mixed and the depth filter takes them
//! off: the scan ends short of the cloth. The rim is carried on along the surface by that much and marked as filled.

use nalgebra::Vector3;
use toile_geometry::{
    Mesh,
    topology::{VertexNeighbors, boundary_loops},
};

/// Directions and widths are smoothed along the rim by this many steps of two neighbours.
const RIM_STEPS: usize = 12;
/// Rings of triangles behind the rim between which the cloth's direction is read.
const CLOTH_RINGS: [usize; 2] = [2, 5];
/// Narrower strips are not added, metres.
const LEAST_WIDTH: f32 = 0.001;

/// Grows a strip on the rims, of the width that `widths` tells for each vertex (metres), smoothed along the rim. New
/// vertices carry `filled` = 1.
pub fn extend(mesh: &mut Mesh, widths: &[f32]) {
    let normals = mesh.vertex_normals();
    let neighbors = VertexNeighbors::new(mesh.positions.len(), &mesh.triangles);
    for rim in boundary_loops(&mesh.triangles).into_iter().filter(|l| l.len() >= 8) {
        let widths = smoothed(rim.iter().map(|&v| widths[v as usize]).collect(), RIM_STEPS);
        let cloth: Vec<Vector3<f32>> = rim.iter().map(|&v| cloth_normal(&normals, &neighbors, v)).collect();
        let outward = smoothed(outward(mesh, &cloth, &rim), RIM_STEPS);
        add_strip(mesh, &rim, &widths, &outward);
    }
    mesh.recompute_normals();
}

/// Normal of the cloth some rings behind a rim vertex: at the rim itself a scan bends towards what lies behind.
fn cloth_normal(normals: &[Vector3<f32>], neighbors: &VertexNeighbors, rim: u32) -> Vector3<f32> {
    let mut found = vec![rim];
    let (mut start, mut behind) = (0, 0);
    for ring in 1..=CLOTH_RINGS[1] {
        let end = found.len();
        for k in start..end {
            for &n in neighbors.of(found[k] as usize) {
                if !found.contains(&n) {
                    found.push(n);
                }
            }
        }
        start = end;
        if ring == CLOTH_RINGS[0] {
            behind = found.len();
        }
    }
    let cloth = if behind < found.len() { &found[behind..] } else { &found[..] };
    let sum: Vector3<f32> = cloth.iter().map(|&v| normals[v as usize]).sum();
    sum.try_normalize(1e-6).unwrap_or(normals[rim as usize])
}

/// Unit vectors along the surface (of the given normals) and away from it, by rim vertex. A loop has the surface on its
/// left.
fn outward(mesh: &Mesh, normals: &[Vector3<f32>], rim: &[u32]) -> Vec<Vector3<f32>> {
    let n = rim.len();
    let at = |i: usize| mesh.positions[rim[i % n] as usize];
    (0..n)
        .map(|i| {
            let along = at(i + 2) - at(i + n - 2);
            along.cross(&normals[i]).try_normalize(1e-9).unwrap_or_else(Vector3::zeros)
        })
        .collect()
}

/// Means over neighbours along a closed rim, `steps` times.
fn smoothed<T>(mut values: Vec<T>, steps: usize) -> Vec<T>
where
    T: Copy + std::ops::Add<Output = T> + std::ops::Mul<f32, Output = T>,
{
    let n = values.len();
    for _ in 0..steps {
        values = (0..n).map(|i| values[i] * 0.5 + (values[(i + n - 1) % n] + values[(i + 1) % n]) * 0.25).collect();
    }
    values
}

fn add_strip(mesh: &mut Mesh, rim: &[u32], widths: &[f32], outward: &[Vector3<f32>]) {
    let mut grown = Vec::with_capacity(rim.len());
    for ((&v, &width), out) in rim.iter().zip(widths).zip(outward) {
        let out = out.try_normalize(0.3).filter(|_| width >= LEAST_WIDTH);
        grown.push(out.map_or(v, |out| copy_moved(mesh, v, out * width)));
    }
    for i in 0..rim.len() {
        let j = (i + 1) % rim.len();
        let (a, b, c, d) = (rim[i], rim[j], grown[j], grown[i]);
        // The loop runs along the triangles inside; the strip's run against it.
        if d != a {
            mesh.triangles.push([a, d, b]);
        }
        if c != b {
            mesh.triangles.push([b, d, c]);
        }
    }
}

fn copy_moved(mesh: &mut Mesh, v: u32, by: Vector3<f32>) -> u32 {
    let v = v as usize;
    mesh.positions.push(mesh.positions[v] + by);
    if !mesh.normals.is_empty() {
        mesh.normals.push(mesh.normals[v]);
    }
    if !mesh.colors.is_empty() {
        mesh.colors.push(mesh.colors[v]);
    }
    for (name, values) in &mut mesh.attributes {
        values.push(if name == "filled" { 1.0 } else { values[v] });
    }
    (mesh.positions.len() - 1) as u32
}

/// Smooths each rim of at least `least_vertices` along itself with standard deviation `deviation` metres. Vertices move
/// along the surface only, so that tubes keep their girth; what lies behind the rim follows, less and less.
pub fn smooth(mesh: &mut Mesh, deviation: f32, least_vertices: usize) {
    let normals = mesh.vertex_normals();
    let mut moves = vec![Vector3::zeros(); mesh.positions.len()];
    for rim in boundary_loops(&mesh.triangles).into_iter().filter(|l| l.len() >= least_vertices) {
        let n = rim.len();
        let positions: Vec<Vector3<f32>> = rim.iter().map(|&v| mesh.positions[v as usize].coords).collect();
        let mean_square =
            (0..n).map(|i| (positions[(i + 1) % n] - positions[i]).norm_squared()).sum::<f32>() / n as f32;
        // A step of weights ¼ ½ ¼ adds half of the squared spacing to the variance.
        let steps = (2.0 * deviation * deviation / mean_square.max(1e-9)).round().min(200.0) as usize;
        let soft = smoothed(positions.clone(), steps);
        let rim_normals: Vec<Vector3<f32>> = rim.iter().map(|&v| normals[v as usize]).collect();
        for (((&v, p), s), out) in rim.iter().zip(&positions).zip(&soft).zip(outward(mesh, &rim_normals, &rim)) {
            moves[v as usize] = out * (s - p).dot(&out);
        }
    }
    follow(mesh, moves);
}

/// Moves the rim, and rings of vertices behind it by ever less.
fn follow(mesh: &mut Mesh, mut moves: Vec<Vector3<f32>>) {
    let mut reached: Vec<bool> = moves.iter().map(|m| m.norm_squared() > 0.0).collect();
    let neighbors = VertexNeighbors::new(mesh.positions.len(), &mesh.triangles);
    for _ in 0..FOLLOWING_RINGS {
        let next: Vec<(usize, Vector3<f32>)> = (0..moves.len())
            .filter(|&v| !reached[v])
            .filter_map(|v| {
                let around: Vec<_> = neighbors.of(v).iter().filter(|&&n| reached[n as usize]).collect();
                let sum: Vector3<f32> = around.iter().map(|&&n| moves[n as usize]).sum();
                (!around.is_empty()).then(|| (v, sum * (FOLLOWING / around.len() as f32)))
            })
            .collect();
        for (v, by) in next {
            (moves[v], reached[v]) = (by, true);
        }
    }
    mesh.positions.iter_mut().zip(moves).for_each(|(p, m)| *p += m);
}

/// Rings behind the rim that follow it.
const FOLLOWING_RINGS: usize = 3;
/// Share of a ring's movement that the next ring makes.
const FOLLOWING: f32 = 0.6;

#[cfg(test)]
mod tests {
    use nalgebra::Point3;
    use toile_geometry::topology::loop_length;

    use super::*;

    /// A tube of radius 50 mm from y = 0 to 0.1, rings 5 mm apart; the upper rim waves by `wave` metres.
    fn tube(wave: f32) -> Mesh {
        let (around, rows) = (60u32, 20u32);
        let positions = (0..=rows)
            .flat_map(|r| (0..around).map(move |i| (r, i)))
            .map(|(r, i)| {
                let a = i as f32 / around as f32 * std::f32::consts::TAU;
                let y = 0.005 * r as f32 + if r == rows { wave * (12.0 * a).sin() } else { 0.0 };
                Point3::new(0.05 * a.sin(), y, 0.05 * a.cos())
            })
            .collect();
        let triangles = (0..rows)
            .flat_map(|r| (0..around).map(move |i| (r * around + i, r * around + (i + 1) % around)))
            .flat_map(|(a, b)| [[a, b, b + around], [a, b + around, a + around]])
            .collect();
        let mut mesh = Mesh::new(positions, triangles);
        mesh.attributes.insert("filled".into(), vec![0.0; mesh.positions.len()]);
        mesh
    }

    #[test]
    fn a_free_rim_grows_along_the_surface_and_a_seen_one_stays() {
        let mut mesh = tube(0.0);
        let widths: Vec<f32> = mesh.positions.iter().map(|p| if p.y > 0.09 { 0.008 } else { 0.0 }).collect();
        let area = mesh.area();
        extend(&mut mesh, &widths);
        let (lo, hi) = mesh.bounds().unwrap();
        assert!((hi[1] - 0.108).abs() < 1e-4 && lo[1].abs() < 1e-6, "{lo} {hi}");
        assert!((mesh.area() / area - 1.08).abs() < 0.01);
        assert_eq!(boundary_loops(&mesh.triangles).len(), 2);
        assert!(mesh.positions.iter().zip(&mesh.attributes["filled"]).all(|(p, &f)| (f > 0.5) == (p.y > 0.101)));
        mesh.validate().unwrap();
    }

    #[test]
    fn a_wavy_rim_is_smoothed_and_keeps_its_girth() {
        let mut mesh = tube(0.003);
        smooth(&mut mesh, 0.02, 8);
        let top = boundary_loops(&mesh.triangles).into_iter().find(|l| mesh.positions[l[0] as usize].y > 0.05).unwrap();
        assert!(top.iter().all(|&v| (mesh.positions[v as usize].y - 0.1).abs() < 0.0012));
        assert!((loop_length(&mesh.positions, &top) / (std::f32::consts::TAU * 0.05) - 1.0).abs() < 0.02);
    }
}
