//! Materials of glTF: their colours and pictures.

use std::sync::Arc;

use image::RgbImage;

use super::{
    super::{Beside, printable, textures},
    accessors::{File, data_uri, unescape},
    json::{Look, Material as JsonMaterial},
};
use crate::Material;

/// All materials, and behind them the one of triangles that have none.
pub(super) fn materials(file: &File, beside: &Beside, notices: &mut Vec<String>) -> Vec<Material> {
    let mut pictures: Vec<Option<Option<Arc<RgbImage>>>> = vec![None; file.root.images.len()];
    let mut of = |material: &JsonMaterial| {
        let look = look(material);
        let texture = look.base_color_texture.as_ref().and_then(|used| file.root.textures.get(used.index));
        let picture = texture.and_then(|texture| texture.source).and_then(|image| {
            let slot = pictures.get_mut(image)?;
            slot.get_or_insert_with(|| {
                let read = picture(file, image, beside);
                read.map_err(|reason| notices.push(format!("picture {image}: {reason}"))).ok()
            })
            .clone()
        });
        let color = look.base_color_factor.map(|[r, g, b, _]| [r, g, b].map(srgb));
        Material { name: printable(&material.name), color, picture }
    };
    let mut all: Vec<Material> = file.root.materials.iter().map(&mut of).collect();
    all.push(Material::default());
    all
}

/// Which of the sets of texture coordinates a material uses.
pub(super) fn coordinate_set(material: Option<&JsonMaterial>) -> usize {
    material.and_then(|m| look(m).base_color_texture.map(|used| used.tex_coord)).unwrap_or(0)
}

fn look(material: &JsonMaterial) -> Look {
    material.extensions.specular_glossiness.clone().unwrap_or_else(|| material.pbr_metallic_roughness.clone())
}

fn picture(file: &File, index: usize, beside: &Beside) -> Result<Arc<RgbImage>, String> {
    let picture = &file.root.images[index];
    match (&picture.uri, picture.buffer_view) {
        (Some(uri), _) => match data_uri(uri) {
            Some(bytes) => textures::decode(&bytes?),
            None => textures::read(&unescape(uri), beside),
        },
        (None, Some(view)) => textures::decode(file.view(view)?),
        (None, None) => Err("has neither a name nor data".into()),
    }
}

/// A linear colour from 0 to 1 as sRGB (IEC 61966-2-1), in which glTF counts factors and vertex colours.
pub(super) fn srgb(linear: f32) -> u8 {
    let x = linear.clamp(0.0, 1.0);
    let encoded = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0).round() as u8
}
