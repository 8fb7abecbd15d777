//! PLY files: binary little endian on the way out; binary (both byte orders) and ASCII on the way in.

mod elements;
mod encode;
mod header;
mod numbers;
#[cfg(test)]
mod tests;

use std::{io::Write, path::Path};

pub use encode::encode;

use crate::{GeometryError, Mesh, file::read_limited};

/// Maximum size of a file, bytes: a scan of twelve million vertices.
const MAX_BYTES: u64 = 1 << 30;

/// Where in a picture the three corners of a triangle lie.
pub type TextureCorners = [[f32; 2]; 3];

/// Reads a PLY file.
///
/// # Errors
/// [`GeometryError::Io`] where it cannot be read, [`GeometryError::Format`] where it is torn or not a triangle mesh.
pub fn read(path: &Path) -> Result<Mesh, GeometryError> {
    decode(&read_limited(path, MAX_BYTES)?).map_err(|reason| GeometryError::format(path, reason))
}

/// Decodes PLY bytes. Polygons are cut into fans; numeric vertex properties of other names become attributes. Colours are
/// bytes, 16-bit numbers, or floats from 0 to 1.
///
/// # Errors
/// A sentence that says what is wrong.
pub fn decode(bytes: &[u8]) -> Result<Mesh, String> {
    decode_textured(bytes).map(|(mesh, _)| mesh)
}

/// As [`decode`], with the texture coordinates that the corners of each triangle have (`texcoord` of the faces, as MeshLab
/// writes them); empty where not every face has them.
///
/// # Errors
/// As [`decode`].
pub fn decode_textured(bytes: &[u8]) -> Result<(Mesh, Vec<TextureCorners>), String> {
    let (header, body) = header::parse(bytes)?;
    let mut numbers = numbers::over(header.format, body)?;
    let (mut mesh, mut texture) = (Mesh::default(), Vec::new());
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => elements::read_vertices(element, numbers.as_mut(), &mut mesh)?,
            "face" => elements::read_faces(element, numbers.as_mut(), &mut mesh, &mut texture)?,
            _ => elements::skip(element, numbers.as_mut())?,
        }
    }
    mesh.validate().map_err(|e| e.to_string())?;
    if texture.len() != mesh.triangles.len() {
        texture.clear();
    }
    Ok((mesh, texture))
}

/// Writes a mesh to `path` in place. Stages write through the pipeline's own whole-or-nothing writer and [`encode`].
///
/// # Errors
/// [`GeometryError::Io`] where the file cannot be written.
pub fn write(path: &Path, mesh: &Mesh) -> Result<(), GeometryError> {
    let mut file = std::fs::File::create(path).map_err(|e| GeometryError::io(path, e))?;
    file.write_all(&encode(mesh)).map_err(|e| GeometryError::io(path, e))
}
