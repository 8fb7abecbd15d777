//! What a vertex of a rough mesh lies on.

use nalgebra::Vector3;

/// Where a vertex of a rough mesh lies on that of a garment below, in the outfit's first pose.
pub(super) struct On {
    pub garment: usize,
    pub corners: [u32; 3],
    pub barycentric: [f32; 3],
    /// Share of its displacement that is the lower garment's.
    pub share: f32,
}

impl On {
    /// The `own` displacement of the vertex, mixed with those of the lower garment's vertices.
    pub fn mixed(&self, own: &Vector3<f32>, moved: &[Vector3<f32>]) -> Vector3<f32> {
        let lower: Vector3<f32> = (0..3).map(|k| moved[self.corners[k] as usize] * self.barycentric[k]).sum();
        own + (lower - own) * self.share
    }
}
