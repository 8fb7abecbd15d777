//! A mesh with a texture, without bones: a scan as binary glTF 2.0.

use nalgebra::{Point3, Vector3};
use serde_json::{Map, Value, json};
use toile_geometry::Mesh;

use crate::{
    AvatarError, Picture,
    buffer::{Buffer, Shape, Target},
    glb::{GENERATOR, finish},
    layer_mesh::{indices, unit},
    material::sampler,
};

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
        "samplers": [sampler()],
        "images": [{ "name": name, "bufferView": view, "mimeType": picture.mime() }],
    });
    let document = match parts {
        Value::Object(map) => map,
        _ => Map::new(),
    };
    finish(buffer, document)
}

/// A mesh with its texture, back from a GLB file that [`write_textured`] wrote: positions, normals and triangles, places in the texture, the
/// picture.
///
/// # Errors
/// [`AvatarError::Avatar`] where it is not such a file.
pub fn read_textured(bytes: &[u8]) -> Result<(Mesh, Vec<[f32; 2]>, Picture), AvatarError> {
    let lacks = |what: &str| AvatarError::Avatar(format!("it is no mesh with a texture as Toile writes them: {what}"));
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice(bytes).map_err(|e| lacks(&e.to_string()))?;
    let blob = blob.ok_or_else(|| lacks("it has no binary part"))?;
    let mesh = document.meshes().next().ok_or_else(|| lacks("it has no mesh"))?;
    let primitive = mesh.primitives().next().ok_or_else(|| lacks("it has no triangles"))?;
    let reader = primitive.reader(|_| Some(&blob));
    let positions: Vec<Point3<f32>> =
        reader.read_positions().ok_or_else(|| lacks("it has no positions"))?.map(Point3::from).collect();
    let normals = reader.read_normals().map_or_else(Vec::new, |n| n.map(Vector3::from).collect());
    let uv: Vec<[f32; 2]> =
        reader.read_tex_coords(0).ok_or_else(|| lacks("it has no places in a texture"))?.into_f32().collect();
    let corners: Vec<u32> = reader.read_indices().ok_or_else(|| lacks("it has no indices"))?.into_u32().collect();
    let image = document.images().next().ok_or_else(|| lacks("it has no picture"))?;
    let gltf::image::Source::View { view, mime_type } = image.source() else {
        return Err(lacks("its picture is not in it"));
    };
    let file = blob.get(view.offset()..view.offset() + view.length()).ok_or_else(|| lacks("its picture is cut off"))?;
    let picture = if mime_type == "image/png" { Picture::Png(file.to_vec()) } else { Picture::Jpeg(file.to_vec()) };
    let mesh = Mesh { normals, ..Mesh::new(positions, corners.as_chunks().0.to_vec()) };
    mesh.validate().map_err(|e| lacks(&e.to_string()))?;
    if uv.len() != mesh.positions.len() {
        return Err(lacks("its places in the texture are not as many as its vertices"));
    }
    Ok((mesh, uv, picture))
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

    #[test]
    fn what_was_written_is_read_back() {
        let corners = [[0.0, 0.5, 0.0], [1.0, 0.1, 0.3], [0.0, 1.0, 0.0]].map(Point3::from);
        let mesh = Mesh::new(corners.to_vec(), vec![[0, 1, 2]]);
        let (uv, picture) = ([[0.0, 0.25], [0.75, 0.1], [1.0, 1.0]], Picture::Jpeg(vec![0xff, 0xd8, 0xff]));
        let glb = write_textured("scan", &mesh, &uv, &picture).unwrap();
        let (read, places, read_picture) = read_textured(&glb).unwrap();
        assert_eq!((read.positions, read.triangles), (mesh.positions.clone(), mesh.triangles));
        assert_eq!((places.as_slice(), read_picture), (uv.as_slice(), picture));
        assert!(read_textured(&glb[..glb.len() / 2]).is_err());
        assert!(read_textured(b"glTF").unwrap_err().to_string().contains("no mesh with a texture"));
    }
}
