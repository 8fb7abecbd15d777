//! A layer while layers are stacked.

use toile_geometry::{Mesh, intersection::crossings, open_surface::OpenSurface};

/// A layer while layers are stacked: its surface and its gap. Layer 0 is the body.
pub(crate) struct Layer {
    pub surface: OpenSurface,
    /// How far it has to stay over each layer below, metres.
    pub gap: f32,
}

impl Layer {
    pub fn new(mesh: &Mesh, gap: f32) -> Self {
        Self { surface: OpenSurface::new(mesh), gap }
    }

    pub fn mesh(&self) -> &Mesh {
        &self.surface.mesh
    }
}

/// Pairs of triangles of layer `upper` and of any layer below that cross, exactly.
pub(super) fn crossing_pairs(layers: &[Layer], upper: usize) -> Vec<[u32; 2]> {
    let surface = &layers[upper].surface;
    let with = |below: &Layer| crossings(&surface.mesh, &surface.bvh, below.mesh(), &below.surface.bvh);
    layers[..upper].iter().flat_map(with).collect()
}
