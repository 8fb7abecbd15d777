//! Parts of a mesh that cloth covers or leaves uncovered together.

use toile_character::SkinnedMesh;

use crate::surface::Thinned;

/// Side of a patch, metres: about a limb's width.
const PATCH: f32 = 0.12;

/// Cells of a grid over the mesh at rest, one limb's vertices each.
pub(crate) struct Patches {
    /// Patch of each thinned vertex.
    pub of_vertex: Vec<u32>,
    pub count: usize,
}

impl Patches {
    pub fn new(dressed: &SkinnedMesh, picked: &Thinned) -> Self {
        let key = |v: &u32| {
            let p = dressed.mesh.positions[*v as usize];
            (dressed.weights.joints[*v as usize][0], [p.x, p.y, p.z].map(|c| (c / PATCH).floor() as i32))
        };
        let mut keys: Vec<_> = picked.vertices.iter().map(key).collect();
        keys.sort_unstable();
        keys.dedup();
        let of_vertex = picked.vertices.iter().map(|v| keys.binary_search(&key(v)).unwrap_or(0) as u32).collect();
        Self { of_vertex, count: keys.len() }
    }
}
