//! A layer with its texture, between the step that makes it and the avatar's files.

use std::path::Path;

use toile_avatar::{LayerTexture, read_textured};
use toile_capture::files::read_limited;
use toile_geometry::Mesh;

use crate::PipelineError;

/// The largest file of a layer that is read, bytes.
const MAX_BYTES: u64 = 1 << 30;

/// The texture of `mesh`, which the file at `path` shows with it.
///
/// # Errors
/// [`PipelineError`] where the file cannot be read, or shows another mesh.
pub(crate) fn texture_of(path: &Path, mesh: &Mesh) -> Result<LayerTexture, PipelineError> {
    let (shown, uv, base_color) =
        read_textured(&read_limited(path, MAX_BYTES)?).map_err(|e| PipelineError::format(path, e))?;
    let count = mesh.positions.len() as u32;
    let mut source: Vec<u32> =
        (0..shown.positions.len() as u32).map(|v| if v < count { v } else { u32::MAX }).collect();
    if shown.positions.len() < mesh.positions.len() || shown.triangles.len() != mesh.triangles.len() {
        return Err(other(path));
    }
    for (own, of_mesh) in shown.triangles.iter().zip(&mesh.triangles) {
        for (&v, &behind) in own.iter().zip(of_mesh) {
            source[v as usize] = behind;
        }
    }
    // A vertex that no triangle uses stands where its own was; beyond the mesh's there is none.
    let is_same = |(v, &s): (usize, &u32)| mesh.positions.get(s as usize) == Some(&shown.positions[v]);
    if !source.iter().enumerate().all(is_same) {
        return Err(other(path));
    }
    Ok(LayerTexture { source, uv, triangles: shown.triangles, base_color, normal: None })
}

fn other(path: &Path) -> PipelineError {
    PipelineError::format(path, "shows another mesh than its layer's; delete it and run again")
}
