//! How far triangles stretch when their corners move.

use nalgebra::{Matrix2, Point3};
use toile_geometry::Mesh;

/// The largest stretch of each triangle of `mesh` in any direction when its vertices lie at `positions`: the larger
/// singular value of the triangle's deformation; 0 for a triangle of no area.
pub(crate) fn stretches<'a>(mesh: &'a Mesh, positions: &'a [Point3<f32>]) -> impl Iterator<Item = f32> + 'a {
    mesh.triangles.iter().map(|t| {
        let at = |p: &[Point3<f32>]| t.map(|v| p[v as usize]);
        triangle_stretch(&at(&mesh.positions), &at(positions))
    })
}

/// Larger singular value of the linear map from triangle `from` to triangle `to`, each in its own plane; 0 for a
/// triangle of no area.
fn triangle_stretch(from: &[Point3<f32>; 3], to: &[Point3<f32>; 3]) -> f32 {
    let flat = |t: &[Point3<f32>; 3]| {
        let (u, v) = (t[1] - t[0], t[2] - t[0]);
        let x = u.try_normalize(1e-12)?;
        let y = v - x * v.dot(&x);
        Some(Matrix2::new(u.norm(), v.dot(&x), 0.0, y.norm()))
    };
    let map = || Some(flat(to)? * flat(from)?.try_inverse()?);
    map().map_or(0.0, |m| m.singular_values().max())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stretch_along_one_direction_is_found() {
        let mesh = Mesh::new(
            [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.004, 0.009, 0.0]].map(Point3::from).to_vec(),
            vec![[0, 1, 2]],
        );
        let stretched: Vec<Point3<f32>> = mesh.positions.iter().map(|p| Point3::new(p.x, 0.0, 2.5 * p.y)).collect();
        assert!((stretches(&mesh, &stretched).next().unwrap() - 2.5).abs() < 1e-4);
        assert!((stretches(&mesh, &mesh.positions).next().unwrap() - 1.0).abs() < 1e-5);
    }
}
