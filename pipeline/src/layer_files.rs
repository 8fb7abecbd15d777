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

#[cfg(test)]
mod tests {
    use nalgebra::Point3;
    use toile_avatar::{Picture, write_textured};

    use super::*;

    #[test]
    fn a_layer_is_read_back_and_no_other_is_taken_for_it() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]].map(Point3::from);
        let mesh = Mesh::new(corners.to_vec(), vec![[0, 1, 2], [2, 1, 3]]);
        let source = [0, 1, 2, 3, 1, 2];
        let shown = mesh.gather(&source, vec![[0, 1, 2], [5, 4, 3]]);
        let uv = [[0.0, 0.0], [0.4, 0.0], [0.0, 0.4], [0.9, 0.9], [0.9, 0.5], [0.5, 0.9]];
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("layer.glb");
        let picture = Picture::Jpeg(vec![0xff, 0xd8, 0xff]);
        std::fs::write(&path, write_textured("top", &shown, &uv, &picture).unwrap()).unwrap();
        let read = texture_of(&path, &mesh).unwrap();
        assert_eq!((read.source.as_slice(), read.uv.as_slice()), (source.as_slice(), uv.as_slice()));
        assert_eq!((read.triangles, read.base_color), (shown.triangles, picture));
        let turned = Mesh::new(corners.to_vec(), vec![[0, 1, 2], [1, 3, 2]]);
        assert!(texture_of(&path, &turned).unwrap_err().to_string().contains("another mesh"));
        let fewer = Mesh::new(corners.to_vec(), vec![[0, 1, 2]]);
        assert!(texture_of(&path, &fewer).unwrap_err().to_string().contains("another mesh"));
    }
}
