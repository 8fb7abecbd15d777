//! Pictures of meshes.

use image::RgbImage;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_geometry::{
    Mesh,
    raster::{Camera, Raster, rasterize},
};

use crate::{
    RenderError, View, colormap,
    shade::{Lights, linear, srgb},
};

/// Albedo of surfaces without colour.
const CLAY: [u8; 3] = [178, 176, 172];
/// Background of pictures.
pub const BACKGROUND: [u8; 3] = [244, 244, 242];
/// Samples a pixel along each axis.
const SAMPLES: u32 = 2;

/// Colour of a mesh.
#[derive(Debug, Clone, PartialEq)]
pub enum Paint {
    /// Its vertex colours; clay where it has none.
    Vertices,
    /// Neutral grey: shows shape, not colour.
    Clay,
    /// One sRGB colour.
    Solid([u8; 3]),
    /// A vertex attribute through [`colormap::viridis`], from the range's first (dark) to its second value.
    Attribute(String, (f32, f32)),
}

/// A mesh in a picture.
#[derive(Debug, Clone)]
pub struct Drawn<'a> {
    /// The mesh, in world coordinates.
    pub mesh: &'a Mesh,
    /// Its colour.
    pub paint: Paint,
    /// From 0 (invisible) to 1 (hides everything behind it).
    pub opacity: f32,
}

impl<'a> Drawn<'a> {
    /// In its own vertex colours, opaque.
    pub fn colored(mesh: &'a Mesh) -> Self {
        Self { mesh, paint: Paint::Vertices, opacity: 1.0 }
    }

    /// In neutral grey, opaque.
    pub fn clay(mesh: &'a Mesh) -> Self {
        Self { mesh, paint: Paint::Clay, opacity: 1.0 }
    }

    /// In one colour.
    pub fn solid(mesh: &'a Mesh, color: [u8; 3], opacity: f32) -> Self {
        Self { mesh, paint: Paint::Solid(color), opacity }
    }

    /// By a scalar attribute.
    pub fn attribute(mesh: &'a Mesh, name: &str, range: (f32, f32)) -> Self {
        Self { mesh, paint: Paint::Attribute(name.into(), range), opacity: 1.0 }
    }
}

/// Draws meshes fitted into a view, with smooth shading and 2 × 2 samples a pixel.
///
/// # Errors
/// [`RenderError::Mesh`], [`RenderError::Attribute`] name the mesh at fault; [`RenderError::Empty`] where no mesh has a
/// triangle or the picture has no pixel.
pub fn picture(drawn: &[Drawn], view: &View, width: u32, height: u32) -> Result<RgbImage, RenderError> {
    if width == 0 || height == 0 || drawn.iter().all(|d| d.mesh.is_empty()) {
        return Err(RenderError::Empty("it needs at least one triangle to draw and one pixel to draw on".into()));
    }
    let camera = view.camera(drawn.iter().flat_map(|d| used_points(d.mesh)), width, height);
    picture_from(drawn, &camera)
}

/// Draws meshes as a given camera sees them.
///
/// # Errors
/// As [`picture`].
pub fn picture_from(drawn: &[Drawn], camera: &Camera) -> Result<RgbImage, RenderError> {
    check(drawn)?;
    let fine = finer(camera);
    let layers: Vec<Layer> = drawn.iter().map(|d| Layer::new(d, &fine)).collect();
    let lights = lights_of(camera);
    let eye = camera.camera_from_world.inverse_transform_point(&Point3::origin()).cast::<f32>();
    let width = camera.lens.width as usize;
    let mut pixels = vec![0u8; width * camera.lens.height as usize * 3];
    pixels.par_chunks_mut(width * 3).enumerate().for_each(|(row, bytes)| {
        for (column, pixel) in bytes.chunks_exact_mut(3).enumerate() {
            pixel.copy_from_slice(&average(&layers, &lights, &eye, row, column));
        }
    });
    RgbImage::from_raw(camera.lens.width, camera.lens.height, pixels)
        .ok_or_else(|| RenderError::Empty("the picture has no pixels".into()))
}

fn check(drawn: &[Drawn]) -> Result<(), RenderError> {
    for (index, d) in drawn.iter().enumerate() {
        d.mesh.validate().map_err(|source| RenderError::Mesh { index, source })?;
        if let Paint::Attribute(name, _) = &d.paint
            && !d.mesh.attributes.contains_key(name)
        {
            return Err(RenderError::Attribute { index, name: name.clone() });
        }
    }
    Ok(())
}

fn used_points(mesh: &Mesh) -> impl Iterator<Item = Point3<f32>> + '_ {
    mesh.triangles.iter().flatten().filter_map(|&v| mesh.positions.get(v as usize).copied())
}

/// The camera with [`SAMPLES`] times the pixels along each axis, over the same field.
fn finer(camera: &Camera) -> Camera {
    let n = f64::from(SAMPLES);
    let mut lens = camera.lens;
    (lens.width, lens.height) = (lens.width * SAMPLES, lens.height * SAMPLES);
    (lens.fx, lens.fy) = (lens.fx * n, lens.fy * n);
    (lens.cx, lens.cy) = ((lens.cx + 0.5) * n - 0.5, (lens.cy + 0.5) * n - 0.5);
    Camera { lens, ..*camera }
}

/// Lights that stand with the camera.
pub fn lights_of(camera: &Camera) -> Lights {
    let world_from_camera = camera.camera_from_world.rotation.inverse().cast::<f32>();
    Lights::over_the_shoulder(
        world_from_camera * Vector3::x(),
        world_from_camera * -Vector3::y(),
        world_from_camera * -Vector3::z(),
    )
}

/// One mesh as the fine camera sees it.
struct Layer<'a> {
    mesh: &'a Mesh,
    raster: Raster,
    normals: Vec<Vector3<f32>>,
    colors: Vec<[f32; 3]>,
    opacity: f32,
}

impl<'a> Layer<'a> {
    fn new(drawn: &Drawn<'a>, camera: &Camera) -> Self {
        let mesh = drawn.mesh;
        let normals = if mesh.normals.is_empty() { mesh.vertex_normals() } else { mesh.normals.clone() };
        Self { mesh, raster: rasterize(mesh, camera), normals, colors: colors_of(drawn), opacity: drawn.opacity }
    }

    /// Depth and shaded linear colour at a fine pixel.
    fn sample(&self, pixel: usize, lights: &Lights, eye: &Point3<f32>) -> Option<(f32, [f32; 3])> {
        let (t, w) = self.raster.hit(pixel)?;
        let corners = self.mesh.triangles[t].map(|v| v as usize);
        let mut normal = Vector3::zeros();
        let mut at = Vector3::zeros();
        let mut color = [0.0; 3];
        for (v, w) in corners.into_iter().zip(w) {
            normal += self.normals[v] * w;
            at += self.mesh.positions[v].coords * w;
            (0..3).for_each(|k| color[k] += self.colors[v][k] * w);
        }
        let to_eye = eye.coords - at;
        let normal = normal.try_normalize(1e-6).unwrap_or_else(|| to_eye.try_normalize(1e-6).unwrap_or_default());
        let seen = if normal.dot(&to_eye) < 0.0 { -normal } else { normal };
        let brightness = lights.brightness(&seen);
        Some((self.raster.depth[pixel], color.map(|c| c * brightness)))
    }
}

fn colors_of(drawn: &Drawn) -> Vec<[f32; 3]> {
    let mesh = drawn.mesh;
    let plain = |color| vec![linear(color); mesh.positions.len()];
    match &drawn.paint {
        Paint::Vertices if mesh.colors.is_empty() => plain(CLAY),
        Paint::Vertices => mesh.colors.iter().map(|&c| linear(c)).collect(),
        Paint::Clay => plain(CLAY),
        Paint::Solid(color) => plain(*color),
        Paint::Attribute(name, range) => mesh.attributes.get(name).map_or_else(
            || plain(CLAY),
            |values| values.iter().map(|&v| linear(colormap::viridis(v, *range))).collect(),
        ),
    }
}

/// The mean of a pixel's samples, each composited from far to near.
fn average(layers: &[Layer], lights: &Lights, eye: &Point3<f32>, row: usize, column: usize) -> [u8; 3] {
    let n = SAMPLES as usize;
    let mut sum = [0.0; 3];
    let mut hits: Vec<(f32, [f32; 3], f32)> = Vec::with_capacity(layers.len());
    for sample in 0..n * n {
        hits.clear();
        for layer in layers.iter().filter(|l| l.opacity > 0.0) {
            let pixel = (row * n + sample / n) * layer.raster.width + column * n + sample % n;
            hits.extend(layer.sample(pixel, lights, eye).map(|(z, color)| (z, color, layer.opacity.min(1.0))));
        }
        hits.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut color = linear(BACKGROUND);
        for (_, layer, opacity) in &hits {
            (0..3).for_each(|k| color[k] += (layer[k] - color[k]) * opacity);
        }
        (0..3).for_each(|k| sum[k] += color[k].min(1.0));
    }
    srgb(sum.map(|s| s / (n * n) as f32))
}
