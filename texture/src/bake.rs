//! From pictures to texels.

use rayon::prelude::*;
use toile_geometry::Mesh;

use crate::{
    Atlas, Photo, TextureError, TextureSettings,
    level::Levels,
    light::Light,
    pad::pad,
    photo::{Shot, shots, srgb_of_linear},
    raster,
    report::TextureReport,
    sight::{Sight, Surface},
    spline, views,
};

/// A picture of less weight at a texel is not looked up.
const NEGLIGIBLE: f32 = 0.02;

/// A baked texture.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    /// Texels along an edge.
    pub size: u32,
    /// sRGB, row by row; between charts the colours of the nearest ones.
    pub pixels: Vec<[u8; 3]>,
    /// 255 where a picture shows the texel's place, 128 where it was filled from its surroundings, 0 between charts.
    pub seen: Vec<u8>,
    /// What was decided.
    pub report: TextureReport,
}

/// Bakes `photos` of a mesh into the texture of its `atlas`.
///
/// # Errors
/// [`TextureError`] where a picture is none, or no picture shows the surface.
pub fn bake(
    mesh: &Mesh,
    atlas: &Atlas,
    photos: &[Photo],
    settings: &TextureSettings,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<Texture, TextureError> {
    settings.check()?;
    let chosen = evenly(photos, settings.photos as usize);
    let surface = Surface::new(mesh);
    let shots = shots(&chosen, mesh)?;
    progress(0.3);
    let sights: Vec<Sight> = shots.par_iter().map(|shot| Sight::new(shot, &surface)).collect();
    progress(0.4);
    let light = if settings.even_light { Light::solve(&shots, &sights, &surface) } else { Light::even(shots.len()) };
    progress(0.5);
    let levels = Levels::new(&shots, &sights, &surface, &light);
    let weights = views::choose(&sights, &levels, settings.blended as usize);
    progress(0.6);
    let baker = Baker { mesh, shots: &shots, sights: &sights, levels: &levels, weights: &weights };
    let texels = baker.texels(atlas);
    progress(0.8);
    let report = TextureReport::new(mesh, atlas, &levels, shots.len());
    let seen = texels.iter().map(|texel| texel[3]).collect();
    let mut pixels = pad(texels, atlas.size as usize);
    pixels.shrink_to_fit();
    progress(0.9);
    Ok(Texture { size: atlas.size, pixels, seen, report })
}

/// At most `most` pictures, evenly spread.
fn evenly(photos: &[Photo], most: usize) -> Vec<Photo> {
    let step = photos.len().div_ceil(most.max(1)).max(1);
    photos.iter().step_by(step).cloned().collect()
}

/// Everything that a texel is made of.
struct Baker<'a> {
    mesh: &'a Mesh,
    shots: &'a [Shot],
    sights: &'a [Sight],
    levels: &'a Levels,
    /// Pictures of each vertex and their weights.
    weights: &'a [Vec<(u16, f32)>],
}

/// A triangle, and the pictures that its texels come from.
struct Piece {
    colors: [[f32; 3]; 3],
    views: Vec<View>,
}

/// A picture as a triangle sees it, at its three corners.
struct View {
    shot: usize,
    pixels: [[f32; 2]; 3],
    weights: [f32; 3],
    gains: [f32; 3],
}

impl Baker<'_> {
    /// sRGB and whether it was seen, of all texels; 0 between charts.
    fn texels(&self, atlas: &Atlas) -> Vec<[u8; 4]> {
        let size = atlas.size as usize;
        let mut texels = vec![[0u8; 4]; size * size];
        let codes = codes();
        raster::draw(
            atlas,
            &mut texels,
            |t| self.piece(self.mesh.triangles[t].map(|v| v as usize)),
            |piece, w, texel| {
                let (color, is_seen) = self.color(piece, w);
                let [r, g, b] = color.map(|c| encode(&codes, c));
                *texel = [r, g, b, if is_seen { 255 } else { 128 }];
            },
        );
        texels
    }

    fn piece(&self, corners: [usize; 3]) -> Piece {
        let mut used: Vec<u16> = corners.iter().flat_map(|&v| self.weights[v].iter().map(|w| w.0)).collect();
        used.sort_unstable();
        used.dedup();
        let weight = |v: usize, shot: u16| self.weights[v].iter().find(|w| w.0 == shot).map_or(0.0, |w| w.1);
        let view = |shot: u16| {
            let f = usize::from(shot);
            // Of a corner behind something else the triangle's other corners tell nothing.
            let is_shown = corners.iter().all(|&v| self.sights[f].pixel[v][0] > -1e5);
            is_shown.then(|| View {
                shot: f,
                pixels: corners.map(|v| self.sights[f].pixel[v]),
                weights: corners.map(|v| weight(v, shot)),
                gains: corners.map(|v| self.levels.gains[f][v]),
            })
        };
        Piece { colors: corners.map(|v| self.levels.colors[v]), views: used.into_iter().filter_map(view).collect() }
    }

    /// Linear colour at barycentric coordinates of a piece, and whether a picture shows it.
    #[inline]
    fn color(&self, piece: &Piece, w: [f32; 3]) -> ([f32; 3], bool) {
        let (mut sum, mut total) = ([0.0f32; 3], 0.0f32);
        for view in &piece.views {
            let weight = mix(view.weights, w);
            if weight < NEGLIGIBLE {
                continue;
            }
            let (shot, balance) = (&self.shots[view.shot], self.levels.balance[view.shot]);
            let gain = weight * mix(view.gains, w);
            let [x, y] = [0, 1].map(|k| mix(view.pixels.map(|p| p[k]), w));
            let pixel = spline::at(&shot.coefficients, shot.width, shot.height, x, y);
            for k in 0..3 {
                sum[k] += gain * balance[k] * pixel[k];
            }
            total += weight;
        }
        if total > 0.05 {
            return (sum.map(|s| s / total), true);
        }
        let own = [0, 1, 2].map(|k| mix(piece.colors.map(|c| c[k]), w));
        (own, false)
    }
}

#[inline]
fn mix(values: [f32; 3], w: [f32; 3]) -> f32 {
    values[0] * w[0] + values[1] * w[1] + values[2] * w[2]
}

/// sRGB bytes of linear values in 4096ths.
fn codes() -> Vec<u8> {
    (0..=4096).map(|i| (srgb_of_linear(i as f32 / 4096.0) * 255.0).round() as u8).collect()
}

#[inline]
fn encode(codes: &[u8], linear: f32) -> u8 {
    // Dark values lie closer than the table's steps.
    if linear < 0.02 {
        return (srgb_of_linear(linear.max(0.0)) * 255.0).round() as u8;
    }
    codes[(linear.min(1.0) * 4096.0 + 0.5) as usize]
}
