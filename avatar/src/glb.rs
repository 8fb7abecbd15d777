//! The avatar as binary glTF 2.0.

use serde_json::{Map, Value, json};

use crate::{Avatar, AvatarError, buffer::Buffer, clip::clip, layer_mesh, material::Materials, rig::Rig};

/// The program that wrote the file, for `asset.generator`.
pub(crate) const GENERATOR: &str = concat!("Toile ", env!("CARGO_PKG_VERSION"));

/// The avatar as a GLB file.
///
/// One mesh node a layer, named as the layer, positions exactly as in the avatar's meshes (metres, +Y up), those of vertices on borders of a
/// texture's charts once more behind them; one
/// skin of 52 joint nodes, by default with VRM's names, that rest in `pose0`; one animation a motion. The same avatar gives the
/// same bytes. A single layer makes a rigged scan.
///
/// # Errors
/// The error of [`Avatar::validate`].
pub fn write_glb(avatar: &Avatar) -> Result<Vec<u8>, AvatarError> {
    avatar.validate()?;
    let rig = Rig::posed(&avatar.skeleton, &avatar.pose0);
    let mut buffer = Buffer::default();
    let mut document = document(avatar, &rig, &mut buffer);
    let clips: Vec<Value> =
        avatar.motions.iter().filter_map(|m| clip(&avatar.skeleton, &avatar.pose0, m, &mut buffer)).collect();
    if !clips.is_empty() {
        document.insert("animations".into(), Value::Array(clips));
    }
    finish(buffer, document)
}

/// Everything but animations and extensions: joint nodes first, then a mesh node a layer.
pub(crate) fn document(avatar: &Avatar, rig: &Rig, buffer: &mut Buffer) -> Map<String, Value> {
    let mut nodes = rig.nodes(avatar.joint_names);
    let first_mesh_node = nodes.len();
    let (mut meshes, mut materials) = (Vec::new(), Materials::default());
    for (index, layer) in avatar.layers.iter().enumerate() {
        meshes.push(layer_mesh::layer_mesh(layer, index, buffer));
        materials.add(layer, buffer);
        nodes.push(json!({
            "name": layer.name,
            "mesh": index,
            "skin": 0,
            "extras": layer_mesh::extras(layer),
        }));
    }
    // Skinned meshes belong at the top: a parent's transform would be ignored.
    let roots: Vec<usize> = std::iter::once(rig.top()).chain(first_mesh_node..nodes.len()).collect();
    let skin = rig.skin(buffer);
    let parts = json!({
        "asset": { "version": "2.0", "generator": GENERATOR },
        "scene": 0,
        "scenes": [{ "name": avatar.name, "nodes": roots }],
        "nodes": nodes,
        "meshes": meshes,
        "skins": [skin],
    });
    let mut document = match parts {
        Value::Object(map) => map,
        _ => Map::new(),
    };
    materials.finish(&mut document);
    document
}

/// The file, if its lengths fit the format's 32 bits.
pub(crate) fn finish(buffer: Buffer, document: Map<String, Value>) -> Result<Vec<u8>, AvatarError> {
    const LARGEST: usize = 0xF000_0000;
    if buffer.bytes.len() > LARGEST {
        return Err(AvatarError::Avatar("it is larger than the 4 GB a GLB file can hold; decimate its layers".into()));
    }
    Ok(buffer.into_glb(document))
}
