//! Vertices around which nothing can cross.

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::{Mesh, mesh::vertex_normals};

/// Least cosine between a triangle's normal and its vertex's: far more than the rounding of either.
const FACES: f32 = 0.05;

/// For each vertex, true where its triangles go once around it and, seen along its normal, lie side by side: no two of them cross.
pub(super) fn lie_open(mesh: &Mesh) -> Vec<bool> {
    let normals = vertex_normals(&mesh.positions, &mesh.triangles);
    let across: Vec<Vector3<f32>> = normals.par_iter().map(across).collect();
    let mut fans = vec![Fan::default(); normals.len()];
    for triangle in &mesh.triangles {
        for k in 0..3 {
            let [v, next, last] = [triangle[k], triangle[(k + 1) % 3], triangle[(k + 2) % 3]];
            let at = |v: u32| mesh.positions[v as usize];
            let (to_next, to_last) = (at(next) - at(v), at(last) - at(v));
            let (up, ray) = (&normals[v as usize], &across[v as usize]);
            let area = to_next.cross(&to_last);
            let fan = &mut fans[v as usize];
            fan.ends = fan.ends.wrapping_add(u64::from(next)).wrapping_sub(u64::from(last));
            fan.turned |= area.dot(up) <= FACES * area.norm();
            // In a fan that winds once around the normal, one triangle holds any ray.
            let holds = up.dot(&to_next.cross(ray)) >= 0.0 && up.dot(&to_last.cross(ray)) < 0.0;
            fan.windings += u32::from(holds);
        }
    }
    fans.iter().map(|fan| !fan.turned && fan.ends == 0 && fan.windings == 1).collect()
}

/// The triangles around a vertex.
#[derive(Clone, Copy, Default)]
struct Fan {
    /// One faces away from the vertex's normal.
    turned: bool,
    /// Sum of the vertices at which sides begin less that of those at which they end: 0 where it closes.
    ends: u64,
    /// Triangles that hold one ray.
    windings: u32,
}

/// Some direction across `up`.
fn across(up: &Vector3<f32>) -> Vector3<f32> {
    if up.x.abs() < 0.6 { up.cross(&Vector3::x()) } else { up.cross(&Vector3::y()) }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    /// A vertex with `n` triangles around it that go `turns` times around, rising as they do.
    fn fan(n: u32, turns: f32, rise: f32) -> Mesh {
        let around = |k: u32| {
            let share = k as f32 / n as f32;
            let angle = share * turns * std::f32::consts::TAU;
            Point3::new(angle.cos(), rise * (share - 0.5) * (share - 0.5), -angle.sin())
        };
        let positions = std::iter::once(Point3::origin()).chain((0..n).map(around)).collect();
        Mesh::new(positions, (0..n).map(|k| [0, 1 + k, 1 + (k + 1) % n]).collect())
    }

    #[test]
    fn a_fan_that_winds_once_lies_open_and_one_that_winds_twice_or_is_folded_does_not() {
        assert!(lie_open(&fan(6, 1.0, 0.1))[0]);
        assert!(!lie_open(&fan(9, 2.0, 0.1))[0]);
        let mut open = fan(6, 1.0, 0.1);
        open.triangles.pop();
        assert!(!lie_open(&open)[0], "a fan with a gap may fold over itself unseen");
        let mut folded = fan(6, 1.0, 0.0);
        folded.positions[3] = Point3::new(0.5, 0.0, 0.8);
        assert!(!lie_open(&folded)[0]);
    }
}
