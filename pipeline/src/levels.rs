//! The avatar in levels of detail: each layer with fewer triangles, at the same places of its texture, with the relief of the whole one as a normal map.

use std::collections::BTreeMap;

use image::{RgbImage, imageops};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use toile_avatar::{Avatar, AvatarLayer, LayerTexture, Picture, tangents};
use toile_geometry::Mesh;
use toile_texture::{Seamed, Shape, encode_png, encode_rgb_jpeg, relief, simplify};

use crate::template_atlas::PADDING;

/// The levels without a word about them, triangles a layer.
pub const LEVELS: [usize; 4] = [60_000, 20_000, 6_000, 2_000];
/// Fewest triangles of a level.
pub const FEWEST: usize = 100;
/// Share of a picture's edge that a chart's outline may move: charts are `PADDING` texels from the middle between them at 4096, less one for filtering.
const ROOM: f32 = (PADDING - 1) as f32 / 4096.0;
/// The relief of a scan has nothing finer than a quarter of the edges that garments are meshed with, metres.
const RELIEF: f64 = 0.0015;
/// Edges of the normal maps, texels.
const SIZES: [u32; 3] = [512, 1024, 2048];
/// Smallest edge that the colours of a level are brought down to, texels.
const SMALLEST: u32 = 1024;

/// The triangles of each layer in a level of detail.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Level {
    /// Triangles that were asked for, a layer.
    pub asked: usize,
    /// Triangles by layer.
    pub triangles: BTreeMap<String, usize>,
}

/// The file of the level with `triangles` triangles a layer: `avatar-20k.glb`.
pub(crate) fn file_name(triangles: usize) -> String {
    if triangles.is_multiple_of(1000) {
        format!("avatar-{}k.glb", triangles / 1000)
    } else {
        format!("avatar-{triangles}.glb")
    }
}

/// The avatar in each of `levels`, which fall. A layer with no more triangles than a level asks for is whole there.
///
/// # Errors
/// A sentence where a texture cannot be read or written.
pub(crate) fn levels(avatar: &Avatar, levels: &[usize]) -> Result<Vec<(Avatar, Level)>, String> {
    let of_layer = |layer: &AvatarLayer| {
        let whole = Whole::new(layer);
        let simple = whole.simplified(levels);
        (0..levels.len()).map(|k| whole.level(&simple[k], k)).collect::<Result<Vec<_>, _>>()
    };
    let by_layer: Vec<Vec<AvatarLayer>> = avatar.layers.par_iter().map(of_layer).collect::<Result<_, _>>()?;
    let level = |(k, &asked): (usize, &usize)| {
        let layers: Vec<AvatarLayer> = by_layer.iter().map(|levels| levels[k].clone()).collect();
        let triangles = layers.iter().map(|l| (l.name.clone(), l.mesh.triangles.len())).collect();
        (Avatar { layers, ..avatar.clone() }, Level { asked, triangles })
    };
    Ok(levels.iter().enumerate().map(level).collect())
}

/// A layer with all its triangles, and what its levels are made from.
struct Whole<'a> {
    layer: &'a AvatarLayer,
    /// With normals.
    mesh: Mesh,
    source: Vec<u32>,
    triangles: &'a [[u32; 3]],
}

impl<'a> Whole<'a> {
    fn new(layer: &'a AvatarLayer) -> Self {
        let mesh = Mesh { normals: layer.mesh.vertex_normals(), ..layer.mesh.clone() };
        let own = || (0..layer.mesh.positions.len() as u32).collect();
        let source = layer.texture.as_ref().map_or_else(own, |t| t.source.clone());
        let triangles = layer.texture.as_ref().map_or(layer.mesh.triangles.as_slice(), |t| &t.triangles);
        Self { layer, mesh, source, triangles }
    }

    /// The triangles of each level, in vertices of the texture.
    fn simplified(&self, levels: &[usize]) -> Vec<Vec<[u32; 3]>> {
        let uv = self.layer.texture.as_ref().map_or(&[][..], |t| &t.uv);
        let (positions, source) = (self.mesh.positions.as_slice(), self.source.as_slice());
        simplify(&Seamed { positions, source, uv, triangles: self.triangles, room: ROOM }, levels)
    }

    /// The layer with these triangles, as level `k` has it.
    fn level(&self, triangles: &[[u32; 3]], k: usize) -> Result<AvatarLayer, String> {
        let of_mesh = |t: &[u32; 3]| t.map(|v| self.source[v as usize]);
        let simple =
            Mesh { triangles: triangles.iter().map(of_mesh).collect(), normals: Vec::new(), ..self.mesh.clone() };
        let (mut mesh, old_of_new) = simple.filter_triangles(|_| true);
        mesh.recompute_normals();
        let texture = match &self.layer.texture {
            Some(whole) => {
                let part =
                    LayerTexture { triangles: triangles.to_vec(), ..whole.clone() }.of_part(|_| true, &old_of_new);
                let is_whole = triangles.len() == self.triangles.len();
                let normal = if is_whole { None } else { Some(self.relief(whole, &part, &mesh)?) };
                Some(LayerTexture { base_color: smaller(&whole.base_color, k)?, normal, ..part })
            }
            None => None,
        };
        Ok(AvatarLayer { mesh, weights: self.layer.weights.gather(&old_of_new), texture, ..self.layer.clone() })
    }

    /// The normal map that gives the simple mesh the whole one's relief.
    fn relief(&self, whole: &LayerTexture, part: &LayerTexture, mesh: &Mesh) -> Result<Picture, String> {
        let drawn = mesh.gather(&part.source, part.triangles.clone());
        let fine: Vec<_> = whole.source.iter().map(|&v| self.mesh.normals[v as usize]).collect();
        let used = (self.mesh.area() / 0.55).sqrt();
        let size = SIZES.into_iter().find(|&size| used / f64::from(size) <= RELIEF).unwrap_or(SIZES[SIZES.len() - 1]);
        let fine = Shape { uv: &whole.uv, normals: &fine, triangles: &whole.triangles };
        let simple = Shape { uv: &part.uv, normals: &drawn.normals, triangles: &part.triangles };
        let pixels = relief(&fine, &simple, &tangents(&drawn, &part.uv), size);
        Ok(Picture::Png(encode_png(&pixels, size).map_err(|e| e.to_string())?))
    }
}

/// The colours for level `k`: whole for the first two, then half the edge, and half of that.
fn smaller(picture: &Picture, k: usize) -> Result<Picture, String> {
    let Picture::Jpeg(bytes) = picture else { return Ok(picture.clone()) };
    let halvings = k.saturating_sub(1);
    if halvings == 0 {
        return Ok(picture.clone());
    }
    let decoded = image::load_from_memory_with_format(bytes, image::ImageFormat::Jpeg).map_err(|e| e.to_string())?;
    let full = decoded.into_rgb8();
    let size = (full.width() >> halvings).max(SMALLEST).min(full.width());
    let small: RgbImage = imageops::resize(&full, size, size, imageops::FilterType::Triangle);
    encode_rgb_jpeg(small.as_raw().as_chunks::<3>().0, size).map(Picture::Jpeg).map_err(|e| e.to_string())
}
