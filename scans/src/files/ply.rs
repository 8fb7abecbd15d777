//! PLY with vertex colours, or with a picture: `comment TextureFile NAME` in the header, and texture coordinates at the
//! vertices (`s` and `t`, `u` and `v`, `texture_u` and `texture_v`) or at the corners of faces (`texcoord`), as MeshLab
//! and its relatives write them.

use toile_geometry::{Mesh, ply};

use super::{Beside, textures};
use crate::{Material, Surface};

/// Names of texture coordinates of vertices.
const COORDINATES: [[&str; 2]; 3] = [["s", "t"], ["u", "v"], ["texture_u", "texture_v"]];
/// A header is never longer, bytes.
const MAX_HEADER: usize = 1 << 16;

/// Decodes PLY bytes without the picture that it may name.
///
/// # Errors
/// A sentence that says what is wrong.
pub fn decode_ply(bytes: &[u8]) -> Result<Surface, String> {
    decode(bytes, &Beside::nothing())
}

pub(super) fn decode(bytes: &[u8], beside: &Beside) -> Result<Surface, String> {
    let (mesh, corners) = ply::decode_textured(bytes)?;
    let coordinates = if corners.is_empty() { at_vertices(&mesh) } else { corners };
    let mut surface = Surface { colors: mesh.colors, ..Surface::new(mesh.positions, mesh.triangles) };
    for name in named_files(bytes) {
        match textures::read(&name, beside) {
            Ok(picture) => surface.materials.push(Material { name, color: None, picture: Some(picture) }),
            Err(reason) => {
                surface.notices.push(reason);
                surface.materials.push(Material { name, ..Material::default() });
            }
        }
    }
    // Which face has which of several pictures is not in a field that writers agree upon.
    if surface.materials.len() > 1 {
        surface.notices.push("it has several pictures, of which only the first is used".into());
    }
    if !surface.materials.is_empty() && !coordinates.is_empty() {
        // PLY counts heights in a picture from below.
        let flipped = coordinates.into_iter().map(|corners| corners.map(|[u, v]| [u, 1.0 - v]));
        surface.texture_coordinates = flipped.collect();
        surface.material_of = vec![0; surface.triangles.len()];
    }
    Ok(surface)
}

/// Texture coordinates of vertices, a triple for each triangle; empty where there are none.
fn at_vertices(mesh: &Mesh) -> Vec<[[f32; 2]; 3]> {
    let columns = |[u, v]: [&str; 2]| Some((mesh.attributes.get(u)?, mesh.attributes.get(v)?));
    let Some((us, vs)) = COORDINATES.into_iter().find_map(columns) else { return Vec::new() };
    mesh.triangles.iter().map(|t| t.map(|v| [us[v as usize], vs[v as usize]])).collect()
}

/// The pictures that the header names.
pub(super) fn named_files(bytes: &[u8]) -> Vec<String> {
    let head = &bytes[..bytes.len().min(MAX_HEADER)];
    let text = String::from_utf8_lossy(head);
    let lines = text.lines().take_while(|line| line.trim() != "end_header");
    let named = lines.filter_map(|line| line.trim().strip_prefix("comment")?.trim().strip_prefix("TextureFile"));
    named.map(|name| name.trim().to_string()).filter(|name| !name.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_found_by_corners_and_by_vertices() {
        let dir = tempfile::tempdir().unwrap();
        let mut picture = image::RgbImage::new(2, 2);
        picture.put_pixel(0, 1, image::Rgb([200, 10, 20]));
        picture.save(dir.path().join("skin.png")).unwrap();
        let head = "ply\nformat ascii 1.0\ncomment TextureFile skin.png\nelement vertex 3\nproperty float x\nproperty float y\n\
            property float z\n";
        let corners = format!(
            "{head}element face 1\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n\
             0 0 0\n1 0 0\n0 1 0\n3 0 1 2 6 0.25 0.25 0.25 0.75 0.75 0.75\n"
        );
        let vertices = format!(
            "{head}property float s\nproperty float t\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
             0 0 0 0.25 0.25\n1 0 0 0.25 0.75\n0 1 0 0.75 0.75\n3 0 1 2\n"
        );
        for text in [corners, vertices] {
            let path = dir.path().join("scan.ply");
            std::fs::write(&path, &text).unwrap();
            let surface = crate::read(&path).unwrap();
            assert_eq!(surface.color_at(0, [1.0, 0.0, 0.0]), Some([200, 10, 20]), "the left lower pixel");
            assert_eq!(surface.color_at(0, [0.0, 1.0, 0.0]), Some([0; 3]));
            assert_eq!(crate::others(&path).unwrap(), ["skin.png"]);
            let alone = decode_ply(text.as_bytes()).unwrap();
            assert!(alone.notices[0].contains("skin.png") && !alone.has_colors());
        }
    }
}
