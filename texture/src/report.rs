//! What the stage decided.

use serde::{Deserialize, Serialize};
use toile_geometry::{Mesh, areas::triangle_area};

use crate::{Atlas, level::Levels};

/// What was decided.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct TextureReport {
    /// Texels along an edge.
    pub size: u32,
    /// Charts of the atlas.
    pub charts: usize,
    /// Share of the texels that triangles cover, percent.
    pub used_percent: f64,
    /// Millimetres that a texel is long.
    pub millimetres_per_texel: f64,
    /// Pictures that were used; 0 where the texture was carried over from another surface.
    pub photos: usize,
    /// Share of the surface that a picture shows, percent; the rest is filled.
    pub seen_percent: f64,
}

impl TextureReport {
    pub(crate) fn new(mesh: &Mesh, atlas: &Atlas, levels: &Levels, photos: usize) -> Self {
        let (mut seen, mut all) = (0.0f64, 0.0f64);
        for (t, corners) in mesh.triangles.iter().enumerate() {
            let area = f64::from(triangle_area(mesh.corners(t)));
            all += area;
            if corners.iter().all(|&v| levels.is_seen[v as usize]) {
                seen += area;
            }
        }
        Self { photos, seen_percent: percent(seen / all.max(1e-12)), ..Self::of_atlas(mesh, atlas) }
    }

    /// Of a texture that was carried over: `seen` as in [`crate::Texture`].
    pub(crate) fn carried(mesh: &Mesh, atlas: &Atlas, seen: &[u8]) -> Self {
        let drawn = seen.iter().filter(|seen| **seen > 0).count().max(1);
        let seen = seen.iter().filter(|seen| **seen == 255).count();
        Self { seen_percent: percent(seen as f64 / drawn as f64), ..Self::of_atlas(mesh, atlas) }
    }

    fn of_atlas(mesh: &Mesh, atlas: &Atlas) -> Self {
        Self {
            size: atlas.size,
            charts: atlas.charts,
            used_percent: percent(atlas.used()),
            millimetres_per_texel: (atlas.millimetres(mesh) * 1e4).round() / 1e4,
            ..Self::default()
        }
    }
}

/// A share as percent, two decimals.
fn percent(share: f64) -> f64 {
    (share * 1e4).round() / 1e2
}
