//! glTF 2.0 (Khronos): one binary file, or JSON with files beside it. All triangles of the scene where they stand, skinned
//! meshes in the pose that the file's joints have.

mod accessors;
mod json;
mod looks;
mod nodes;
mod primitives;

use json::Root;

use super::Beside;
use crate::Surface;

const MAGIC: &[u8; 4] = b"glTF";
const JSON: u32 = 0x4e4f_534a;
const BIN: u32 = 0x004e_4942;

/// Decodes the bytes of a GLB file without files that it may name.
///
/// # Errors
/// A sentence that says what is wrong.
pub fn decode_glb(bytes: &[u8]) -> Result<Surface, String> {
    decode_binary(bytes, &Beside::nothing())
}

pub(super) fn decode_binary(bytes: &[u8], beside: &Beside) -> Result<Surface, String> {
    let (text, binary) = split(bytes)?;
    decode(text, Some(binary), beside)
}

pub(super) fn decode_text(bytes: &[u8], beside: &Beside) -> Result<Surface, String> {
    decode(bytes, None, beside)
}

fn decode(text: &[u8], binary: Option<&[u8]>, beside: &Beside) -> Result<Surface, String> {
    let root = parse(text)?;
    let file = accessors::File::new(&root, binary, beside)?;
    let mut surface = Surface::default();
    surface.materials = looks::materials(&file, beside, &mut surface.notices);
    for placed in nodes::placed_meshes(&root)? {
        primitives::append(&file, &placed, &mut surface)?;
    }
    if surface.colors.len() != surface.positions.len() {
        surface.colors.clear();
    }
    Ok(surface)
}

/// The JSON and the binary part of a GLB file.
fn split(bytes: &[u8]) -> Result<(&[u8], &[u8]), String> {
    if !bytes.starts_with(MAGIC) {
        return Err("is not a GLB file: it does not start with `glTF`".into());
    }
    let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    if word(4) != Some(2) {
        return Err("is not glTF 2.0: export it with a newer version of its program".into());
    }
    let (mut text, mut binary): (Option<&[u8]>, &[u8]) = (None, &[]);
    let mut at = 12;
    while let (Some(length), Some(kind)) = (word(at), word(at + 4)) {
        let Some(chunk) = bytes.get(at + 8..).and_then(|rest| rest.get(..length as usize)) else {
            return Err(format!("is cut off: a chunk of {length} bytes does not fit into it"));
        };
        match kind {
            JSON if text.is_none() => text = Some(chunk),
            BIN if binary.is_empty() => binary = chunk,
            _ => {}
        }
        at += 8 + chunk.len();
    }
    Ok((text.ok_or("is cut off: its JSON is missing")?, binary))
}

/// The JSON, where nothing in it needs what is not read.
fn parse(text: &[u8]) -> Result<Root, String> {
    let root: Root = serde_json::from_slice(text).map_err(|error| format!("its JSON cannot be read: {error}"))?;
    let packed = ["KHR_draco_mesh_compression", "EXT_meshopt_compression"];
    match root.extensions_required.iter().find(|name| packed.contains(&name.as_str())) {
        Some(name) => Err(format!("is compressed with {name}, which is not read; export it without compression")),
        None => Ok(root),
    }
}

/// The files that it names.
pub(super) fn named_files(bytes: &[u8]) -> Result<Vec<String>, String> {
    let root = parse(if bytes.starts_with(MAGIC) { split(bytes)?.0 } else { bytes })?;
    let uris =
        root.buffers.iter().filter_map(|b| b.uri.clone()).chain(root.images.iter().filter_map(|i| i.uri.clone()));
    Ok(uris.filter(|uri| !uri.starts_with("data:")).map(|uri| accessors::unescape(&uri)).collect())
}

#[cfg(test)]
mod tests;
