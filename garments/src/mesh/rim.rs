//! The rim of a garment, smoothed along itself.

use nalgebra::Vector3;
use toile_geometry::{
    Mesh,
    topology::{VertexNeighbors, boundary_loops},
};

/// Rings behind the rim that follow it.
const FOLLOWING_RINGS: usize = 3;
/// Share of a ring's movement that the next ring makes.
const FOLLOWING: f32 = 0.6;
/// Limit of the smoothing steps.
const MAX_STEPS: f32 = 200.0;

/// Smooths each rim of at least `fewest_vertices` along itself with standard deviation `deviation` metres. Vertices move
/// along the surface only, so that tubes keep their girth; what lies behind the rim follows, less and less.
pub(super) fn smooth(mesh: &mut Mesh, deviation: f32, fewest_vertices: usize) {
    let normals = mesh.vertex_normals();
    let mut moves = vec![Vector3::zeros(); mesh.positions.len()];
    for rim in boundary_loops(&mesh.triangles).into_iter().filter(|l| l.len() >= fewest_vertices) {
        let n = rim.len();
        let positions: Vec<Vector3<f32>> = rim.iter().map(|&v| mesh.positions[v as usize].coords).collect();
        let mean_square =
            (0..n).map(|i| (positions[(i + 1) % n] - positions[i]).norm_squared()).sum::<f32>() / n as f32;
        // A step of weights ¼ ½ ¼ adds half of the squared spacing to the variance.
        let steps = (2.0 * deviation * deviation / mean_square.max(1e-9)).round().min(MAX_STEPS) as usize;
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

/// Unit vectors along the surface (of the given normals) and away from it, by rim vertex. A loop has the surface on its
/// left.
pub(super) fn outward(mesh: &Mesh, normals: &[Vector3<f32>], rim: &[u32]) -> Vec<Vector3<f32>> {
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
pub(super) fn smoothed<T>(mut values: Vec<T>, steps: usize) -> Vec<T>
where
    T: Copy + std::ops::Add<Output = T> + std::ops::Mul<f32, Output = T>,
{
    let n = values.len();
    for _ in 0..steps {
        values = (0..n).map(|i| values[i] * 0.5 + (values[(i + n - 1) % n] + values[(i + 1) % n]) * 0.25).collect();
    }
    values
}

#[cfg(test)]
pub(super) mod tests {
    use nalgebra::Point3;
    use toile_geometry::topology::loop_length;

    use super::*;

    /// A tube of radius 50 mm from y = 0 to 0.1, rings 5 mm apart; the upper rim waves by `wave` metres.
    pub fn tube(wave: f32) -> Mesh {
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
        Mesh::new(positions, triangles)
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
