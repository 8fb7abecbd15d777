//! A take's scan with its texture, back from the files of the step `texture`.

use std::path::Path;

use toile_capture::files::{is_there, read_limited};
use toile_geometry::Mesh;
use toile_scans::{Surface, read};
use toile_texture::Painted;

use crate::{PipelineError, folders::Folders};

/// The largest picture of what was seen, bytes.
const MAX_BYTES: u64 = 256 << 20;

/// A take's scan with its texture.
pub(crate) struct ScanTexture {
    pub mesh: Mesh,
    surface: Surface,
    seen: Vec<u8>,
    /// Whether a triangle may give its colours; empty where all may.
    pub is_usable: Vec<bool>,
}

impl ScanTexture {
    /// Whether the take has a texture.
    pub fn is_there(folders: &Folders, layer: &str) -> bool {
        is_there(&folders.textured(layer)) && is_there(&folders.texture_seen(layer))
    }

    /// Reads it.
    ///
    /// # Errors
    /// [`PipelineError`] where a file is missing or not as the step wrote it.
    pub fn read(folders: &Folders, layer: &str) -> Result<Self, PipelineError> {
        let path = folders.textured(layer);
        let surface = read(&path)?;
        let texture = Self {
            mesh: Mesh::new(surface.positions.clone(), surface.triangles.clone()),
            surface,
            seen: seen(&folders.texture_seen(layer))?,
            is_usable: Vec::new(),
        };
        texture
            .painted()
            .map(drop)
            .ok_or_else(|| PipelineError::format(&path, "has no square texture; delete it and run again"))?;
        Ok(texture)
    }

    /// The scan as a surface that gives its colours; `None` where it has none.
    pub fn painted(&self) -> Option<Painted<'_>> {
        let picture = self.surface.materials.first()?.picture.as_deref()?;
        let size = picture.width();
        let pixels = picture.as_raw().as_chunks::<3>().0;
        let is_square = picture.height() == size && self.seen.len() == pixels.len();
        (is_square && self.surface.texture_coordinates.len() == self.surface.triangles.len()).then_some(Painted {
            mesh: &self.mesh,
            corners: &self.surface.texture_coordinates,
            size,
            pixels,
            seen: &self.seen,
            is_usable: &self.is_usable,
        })
    }

    /// Metres that a texel is long on the scan, on average over the area.
    pub fn texel(&self) -> f64 {
        let size = self.painted().map_or(1.0, |p| f64::from(p.size));
        let area = |[a, b, c]: &[[f32; 2]; 3]| {
            f64::from(0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])).abs())
        };
        let used: f64 = self.surface.texture_coordinates.iter().map(area).sum();
        (self.mesh.area() / used.max(1e-9)).sqrt() / size
    }
}

/// What was seen: 255, 128 or 0 a texel.
fn seen(path: &Path) -> Result<Vec<u8>, PipelineError> {
    let bytes = read_limited(path, MAX_BYTES)?;
    let picture = image::load_from_memory_with_format(&bytes, image::ImageFormat::Png)
        .map_err(|e| PipelineError::format(path, format!("{e}; delete it and run again")))?;
    Ok(picture.into_luma8().into_raw())
}
