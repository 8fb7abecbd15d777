//! The scan segmented by the body: what lies nearest to the trunk is trunk, and no arm follows it.

use nalgebra::{Point3, Vector3};
use toile_character::BodyModel;
use toile_geometry::{bvh::Bvh, mesh::triangle_normals};

/// The body that the scan is segmented by.
pub(crate) struct Segments<'a> {
    triangles: &'a [[u32; 3]],
    /// Vertices at rest, where limbs lie apart.
    rest: &'a [Point3<f32>],
    /// The triangles in the scan's pose, and their normals.
    posed: Bvh,
    normals: Vec<Vector3<f32>>,
}

impl<'a> Segments<'a> {
    /// `rest` and `posed` are the template at rest and in the scan's pose.
    pub fn new(model: &'a BodyModel, rest: &'a [Point3<f32>], posed: &[Point3<f32>]) -> Self {
        let triangles = &model.triangles;
        Self { triangles, rest, posed: Bvh::new(posed, triangles), normals: triangle_normals(posed, triangles) }
    }

    /// Whether a scan point belongs to the surroundings of vertex `v`: the point of the body nearest to it lies within
    /// twice the `reach` of `v` at rest. Where no part of the body is near, it does too.
    pub fn joins(&self, v: usize, point: &Point3<f32>, normal: &Vector3<f32>, reach: f64) -> bool {
        let reach = reach as f32;
        let fits = |t: u32| self.normals[t as usize].dot(normal) > 0.0;
        let Some(hit) = self.posed.closest_where(point, reach, fits) else { return true };
        let corners = self.triangles[hit.triangle as usize].map(|c| self.rest[c as usize].coords);
        let nearest: Vector3<f32> = corners.iter().zip(hit.barycentric).map(|(c, b)| c * b).sum();
        (nearest - self.rest[v].coords).norm() < 2.0 * reach
    }
}
