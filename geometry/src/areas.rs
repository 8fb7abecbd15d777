//! Areas of triangles and of vertices.

use nalgebra::Point3;

use crate::Mesh;

/// Area of a triangle, square metres, in f32.
#[inline]
pub fn triangle_area([a, b, c]: [Point3<f32>; 3]) -> f32 {
    0.5 * (b - a).cross(&(c - a)).norm()
}

/// The area that each vertex stands for: a third of the triangles around it, square metres.
pub fn vertex_areas(mesh: &Mesh) -> Vec<f32> {
    let mut areas = vec![0.0; mesh.positions.len()];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let third = triangle_area(mesh.corners(t)) / 3.0;
        triangle.iter().for_each(|&v| areas[v as usize] += third);
    }
    areas
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_share_the_area_of_their_triangles() {
        let corners = [(0.0, 0.0), (2.0, 0.0), (2.0, 3.0), (0.0, 3.0)].map(|(x, y)| Point3::new(x, y, 1.0));
        let mesh = Mesh::new(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]]);
        assert_eq!(vertex_areas(&mesh), [2.0, 1.0, 2.0, 1.0]);
        assert_eq!(triangle_area(mesh.corners(0)), 3.0);
    }
}
