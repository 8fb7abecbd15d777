//! A mesh with a texture, without bones: a scan as binary glTF 2.0.

use serde_json::{Map, Value, json};
use toile_geometry::Mesh;

use crate::{
    AvatarError,
    buffer::{Buffer, Shape, Target},
    glb::{GENERATOR, finish},
    layer_mesh::{indices, unit},
};

/// A picture as a file's bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Picture {
    /// A JPEG file.
    Jpeg(Vec<u8>),
    /// A PNG file.
    Png(Vec<u8>),
}

impl Picture {
    /// The file.
    pub fn bytes(&self) -> &[u8] {
        match self {
            Self::Jpeg(bytes) | Self::Png(bytes) => bytes,
        }
    }

    /// Its media type.
    pub fn mime(&self) -> &'static str {
        match self {
            Self::Jpeg(_) => "image/jpeg",
            Self::Png(_) => "image/png",
        }
    }
}

/// A mesh with a texture as a GLB file: one node called `name`, positions as they are (metres, +Y up), `uv` a vertex (0 to 1, down).
///
/// # Errors
/// [`AvatarError::Layer`] where the mesh is not one, or `uv` has another length.
pub fn write_textured(name: &str, mesh: &Mesh, uv: &[[f32; 2]], picture: &Picture) -> Result<Vec<u8>, AvatarError> {
    mesh.validate().map_err(|error| AvatarError::layer(name, error.to_string()))?;
    if mesh.is_empty() || uv.len() != mesh.positions.len() || uv.iter().flatten().any(|c| !c.is_finite()) {
        let reason = format!("it has {} vertices, but places in the texture for {}", mesh.positions.len(), uv.len());
        return Err(AvatarError::layer(name, reason));
    }
    let mut buffer = Buffer::default();
    let positions: Vec<f32> = mesh.positions.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
    let normals = if mesh.normals.is_empty() { mesh.vertex_normals() } else { mesh.normals.clone() };
    let normals: Vec<f32> = normals.iter().flat_map(unit).collect();
    let attributes = json!({
        "POSITION": buffer.add_bounded(&positions, Shape::Vec3, Target::Vertices),
        "NORMAL": buffer.add(&normals, Shape::Vec3, Target::Vertices),
        "TEXCOORD_0": buffer.add(uv.as_flattened(), Shape::Vec2, Target::Vertices),
    });
    let triangles = indices(&mesh.triangles, mesh.positions.len(), &mut buffer);
    let view = buffer.add_file(picture.bytes());
    let parts = json!({
        "asset": { "version": "2.0", "generator": GENERATOR },
        "scene": 0,
        "scenes": [{ "name": name, "nodes": [0] }],
        "nodes": [{ "name": name, "mesh": 0 }],
        "meshes": [{ "name": name, "primitives": [{
            "attributes": attributes, "indices": triangles, "material": 0, "mode": 4,
        }] }],
        "materials": [{ "name": name, "pbrMetallicRoughness": {
            "baseColorTexture": { "index": 0 }, "metallicFactor": 0.0, "roughnessFactor": 1.0,
        } }],
        "textures": [{ "source": 0, "sampler": 0 }],
        // Linear with mip levels; nothing repeats.
        "samplers": [{ "magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071 }],
        "images": [{ "name": name, "bufferView": view, "mimeType": picture.mime() }],
    });
    let document = match parts {
        Value::Object(map) => map,
        _ => Map::new(),
    };
    finish(buffer, document)
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    #[test]
    fn places_in_the_texture_must_be_as_many_as_vertices() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(Point3::from);
        let mesh = Mesh::new(corners.to_vec(), vec![[0, 1, 2]]);
        let picture = Picture::Jpeg(vec![0xff, 0xd8, 0xff]);
        let error = write_textured("scan", &mesh, &[[0.0; 2]; 2], &picture).unwrap_err().to_string();
        assert!(error.contains("3 vertices") && error.contains("for 2"), "{error}");
        let glb = write_textured("scan", &mesh, &[[0.0, 0.5]; 3], &picture).unwrap();
        let text = String::from_utf8_lossy(&glb);
        assert!(text.contains("TEXCOORD_0") && text.contains("image/jpeg"));
        assert_eq!(glb.len() % 4, 0);
    }
}
