//! The layers as Wavefront OBJ, with their materials.

use std::fmt::Write;

use crate::{Avatar, AvatarError, AvatarLayer, Picture, layer_mesh::NEUTRAL};

/// The layers at rest as OBJ text: metres, +Y up, an object and a material a layer, named as the layer; unit normals;
/// places in the texture, or colours (sRGB, 0 to 1) behind the positions, as most programs write and read them. `materials` is the file name of
/// what [`write_mtl`] makes. Numbers are written so that they are read back exactly.
///
/// # Errors
/// The error of [`Avatar::validate`].
pub fn write_obj(avatar: &Avatar, materials: &str) -> Result<String, AvatarError> {
    avatar.validate()?;
    let mut text = format!("# metres, +Y up, +Z the front\nmtllib {materials}\n");
    let mut first = [1; 2];
    for layer in &avatar.layers {
        write_layer(layer, first, &mut text).map_err(|_| AvatarError::layer(&layer.name, "too large for a text"))?;
        first[0] += layer.mesh.positions.len();
        first[1] += layer.texture.as_ref().map_or(0, |texture| texture.uv.len());
    }
    Ok(text)
}

/// The materials of [`write_obj`]: matt, with the layers' pictures, which lie beside as [`picture_name`] calls them; white where vertices have colours
/// of their own.
pub fn write_mtl(avatar: &Avatar) -> String {
    let material = |layer: &AvatarLayer| {
        let has_color = layer.texture.is_some() || !layer.mesh.colors.is_empty();
        let [r, g, b] = if has_color { [1.0; 3] } else { NEUTRAL };
        let mut text = format!("newmtl {}\nKd {r} {g} {b}\nKs 0 0 0\nd 1\nillum 1\n", word(&layer.name));
        if let Some(texture) = &layer.texture {
            text.push_str(&format!("map_Kd {}\n", picture_name(&layer.name, "color", &texture.base_color)));
            if let Some(normal) = &texture.normal {
                text.push_str(&format!("norm {}\n", picture_name(&layer.name, "normal", normal)));
            }
        }
        text
    };
    avatar.layers.iter().map(material).collect()
}

/// The file name of a layer's picture beside OBJ and USD files: `avatar-01-top-color.jpg`.
pub fn picture_name(layer: &str, kind: &str, picture: &Picture) -> String {
    format!("avatar-{}-{kind}.{}", word(layer), picture.extension())
}

/// One layer whose first vertex and place in the texture have the numbers `first` in the file.
fn write_layer(layer: &AvatarLayer, [first, first_place]: [usize; 2], text: &mut String) -> std::fmt::Result {
    let (mesh, name) = (&layer.mesh, word(&layer.name));
    writeln!(text, "o {name}")?;
    for (v, p) in mesh.positions.iter().enumerate() {
        write!(text, "v {} {} {}", p.x, p.y, p.z)?;
        if let Some(color) = mesh.colors.get(v).filter(|_| layer.texture.is_none()) {
            // four decimals keep all 256 steps apart
            color.iter().try_for_each(|c| write!(text, " {:.4}", f32::from(*c) / 255.0))?;
        }
        text.push('\n');
    }
    for [x, y, z] in layer.normals() {
        writeln!(text, "vn {x} {y} {z}")?;
    }
    let places = layer.texture.as_ref().map(|texture| &texture.triangles);
    for [u, v] in layer.texture.iter().flat_map(|texture| &texture.uv) {
        // upwards in these files
        writeln!(text, "vt {u} {}", 1.0 - v)?;
    }
    writeln!(text, "usemtl {name}")?;
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = triangle.map(|v| v as usize + first);
        match places.map(|places| places[t].map(|v| v as usize + first_place)) {
            Some([d, e, f]) => writeln!(text, "f {a}/{d}/{a} {b}/{e}/{b} {c}/{f}/{c}")?,
            None => writeln!(text, "f {a}//{a} {b}//{b} {c}//{c}")?,
        }
    }
    Ok(())
}

/// A name as one word, as names are in these files.
fn word(name: &str) -> String {
    name.chars().map(|c| if c.is_whitespace() || c.is_control() { '_' } else { c }).collect()
}
