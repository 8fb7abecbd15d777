//! Tangents for normal maps, as MikkTSpace makes them (Mikkelsen 2008, "Simulation of Wrinkled Surfaces Revisited"), which glTF asks for.

use nalgebra::{Vector2, Vector3};
use toile_geometry::Mesh;

/// The tangent of each vertex: a unit vector along +u at right angles to the normal, and the sign of the bitangent `sign * normal x tangent`, which points
/// against v (glTF's v grows downwards).
///
/// `mesh` has normals and the texture's vertices. Each corner's direction of u is projected onto the plane at right angles to the vertex's normal and weighted by
/// the corner's angle there. MikkTSpace splits vertices whose triangles are mirrored in the picture; our charts are not.
pub fn tangents(mesh: &Mesh, uv: &[[f32; 2]]) -> Vec<[f32; 4]> {
    let mut sums = vec![(Vector3::<f32>::zeros(), 0.0f32); mesh.positions.len()];
    for (t, corners) in mesh.triangles.iter().enumerate() {
        let p = mesh.corners(t);
        let [a, b, c] = corners.map(|v| Vector2::from(uv[v as usize]));
        let (first, second) = (b - a, c - a);
        let double = first.x * second.y - second.x * first.y;
        // the direction of u, whatever its length; upside down where the triangle is mirrored
        let along = ((p[1] - p[0]) * second.y - (p[2] - p[0]) * first.y) * double.signum();
        for k in 0..3 {
            let v = corners[k] as usize;
            let flat = |d: Vector3<f32>| {
                let n = mesh.normals[v];
                (d - n * n.dot(&d)).try_normalize(1e-20)
            };
            let sides = (flat(p[(k + 1) % 3] - p[k]), flat(p[(k + 2) % 3] - p[k]));
            if let (Some(along), (Some(x), Some(y))) = (flat(along), sides) {
                let angle = x.dot(&y).clamp(-1.0, 1.0).acos();
                sums[v].0 += along * angle;
                // v grows downwards: what is the right way round has a negative area there
                sums[v].1 -= angle * double.signum();
            }
        }
    }
    let unit = |(v, (sum, sign)): (usize, &(Vector3<f32>, f32))| {
        let n = mesh.normals[v];
        let aside = if n.x.abs() < 0.8 { Vector3::x() } else { Vector3::z() };
        let along = sum.try_normalize(1e-12).or_else(|| (aside - n * n.dot(&aside)).try_normalize(1e-12));
        let along = along.unwrap_or_else(Vector3::x);
        [along.x, along.y, along.z, if *sign < 0.0 { -1.0 } else { 1.0 }]
    };
    sums.iter().enumerate().map(unit).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    #[test]
    fn the_tangent_runs_along_u_and_the_third_axis_against_v() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]].map(Point3::from);
        let mut mesh = Mesh::new(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]]);
        mesh.recompute_normals();
        // u to the right, v down: seen from +Z as the picture is
        let found = tangents(&mesh, &[[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]);
        assert!(found.iter().all(|t| *t == [1.0, 0.0, 0.0, 1.0]), "{found:?}");
        let mirrored = tangents(&mesh, &[[1.0, 1.0], [0.0, 1.0], [0.0, 0.0], [1.0, 0.0]]);
        assert!(mirrored.iter().all(|t| *t == [-1.0, 0.0, 0.0, -1.0]), "{mirrored:?}");
        let lost = tangents(&mesh, &[[0.5; 2]; 4]);
        assert!(lost.iter().all(|t| t[2] == 0.0 && t[0].abs() == 1.0), "{lost:?}");
    }
}
