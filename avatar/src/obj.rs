//! The layers as Wavefront OBJ, with their materials.

use std::fmt::Write;

use crate::{Avatar, AvatarError, AvatarLayer, layer_mesh::NEUTRAL};

/// The layers at rest as OBJ text: metres, +Y up, an object and a material a layer, named as the layer; unit normals;
/// colours (sRGB, 0 to 1) behind the positions, as most programs write and read them. `materials` is the file name of what
/// [`write_mtl`] makes. Numbers are written so that they are read back exactly.
///
/// # Errors
/// The error of [`Avatar::validate`].
pub fn write_obj(avatar: &Avatar, materials: &str) -> Result<String, AvatarError> {
    avatar.validate()?;
    let mut text = format!("# metres, +Y up, +Z the front\nmtllib {materials}\n");
    let mut first = 1;
    for layer in &avatar.layers {
        write_layer(layer, first, &mut text).map_err(|_| AvatarError::layer(&layer.name, "too large for a text"))?;
        first += layer.mesh.positions.len();
    }
    Ok(text)
}

/// The materials of [`write_obj`]: matt, white where vertices have colours of their own.
pub fn write_mtl(avatar: &Avatar) -> String {
    let material = |layer: &AvatarLayer| {
        let [r, g, b] = if layer.mesh.colors.is_empty() { NEUTRAL } else { [1.0; 3] };
        format!("newmtl {}\nKd {r} {g} {b}\nKs 0 0 0\nd 1\nillum 1\n", word(&layer.name))
    };
    avatar.layers.iter().map(material).collect()
}

/// One layer whose first vertex has the number `first` in the file.
fn write_layer(layer: &AvatarLayer, first: usize, text: &mut String) -> std::fmt::Result {
    let (mesh, name) = (&layer.mesh, word(&layer.name));
    writeln!(text, "o {name}")?;
    for (v, p) in mesh.positions.iter().enumerate() {
        write!(text, "v {} {} {}", p.x, p.y, p.z)?;
        if let Some(color) = mesh.colors.get(v) {
            // four decimals keep all 256 steps apart
            color.iter().try_for_each(|c| write!(text, " {:.4}", f32::from(*c) / 255.0))?;
        }
        text.push('\n');
    }
    for [x, y, z] in layer.normals() {
        writeln!(text, "vn {x} {y} {z}")?;
    }
    writeln!(text, "usemtl {name}")?;
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|v| v as usize + first);
        writeln!(text, "f {a}//{a} {b}//{b} {c}//{c}")?;
    }
    Ok(())
}

/// A name as one word, as names are in these files.
fn word(name: &str) -> String {
    name.chars().map(|c| if c.is_whitespace() || c.is_control() { '_' } else { c }).collect()
}
