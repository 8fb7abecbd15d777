//! Pictures of the surface, and their pixels made ready to be looked up between pixels.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use toile_capture::{ColorImage, RgbImage};
use toile_geometry::{Mesh, Rigid, camera::PinholeCamera};

use crate::{TextureError, spline};

/// A colour picture: who took it, from where, and its bytes.
#[derive(Debug, Clone)]
pub struct Photo {
    /// Frame index in the take, for messages.
    pub frame: u64,
    /// The colour camera, with its lens.
    pub camera: PinholeCamera,
    /// Where the surface stands in the colour camera's frame.
    pub camera_from_surface: Rigid,
    /// How the colour camera is turned in the room, where the lamps rest; identity for a single camera.
    pub room_from_camera: UnitQuaternion<f64>,
    /// The picture.
    pub image: ColorImage,
}

/// The part of a picture that can show the surface, decoded: linear light, as coefficients of cubic B-splines.
pub(crate) struct Shot {
    pub camera: PinholeCamera,
    pub camera_from_surface: Rigid,
    pub room_from_surface: UnitQuaternion<f64>,
    /// Column and row of the part's first pixel.
    pub corner: [usize; 2],
    pub width: usize,
    pub height: usize,
    /// Coefficients, `spline::ONE` for white.
    pub coefficients: Vec<[i16; 3]>,
    /// Linear light in squares of `COARSE` pixels, 0 to 1.
    pub coarse: Vec<[f32; 3]>,
}

/// Pixels along the side of a square of the coarse picture.
pub(crate) const COARSE: usize = 4;
/// Pixels kept around the surface: the reach of the spline's filter, and of what alignment may move.
const MARGIN: f64 = 24.0;

impl Shot {
    /// Decodes the picture where it shows `mesh`; `None` where the surface is not in it, or it cannot be decoded.
    ///
    /// # Errors
    /// [`TextureError::Size`] where it is of another size than its camera.
    pub(crate) fn new(photo: &Photo, mesh: &Mesh) -> Result<Option<Self>, TextureError> {
        let camera = photo.camera;
        let Some((corner, width, height)) = bounds(mesh, &camera, &photo.camera_from_surface) else { return Ok(None) };
        // One picture less is better than none: fusion tells of damaged ones.
        let Ok(image) = photo.image.decode(photo.frame) else { return Ok(None) };
        if (image.width, image.height) != (camera.width, camera.height) {
            return Err(TextureError::Size {
                frame: photo.frame,
                width: image.width,
                height: image.height,
                expected_width: camera.width,
                expected_height: camera.height,
            });
        }
        let linear = crop(&image, corner, width, height);
        Ok(Some(Self {
            camera,
            camera_from_surface: photo.camera_from_surface,
            room_from_surface: photo.room_from_camera * photo.camera_from_surface.rotation,
            corner,
            width,
            height,
            coarse: coarse(&linear, width, height),
            coefficients: spline::coefficients(linear, width),
        }))
    }

    /// Size of the coarse picture.
    pub(crate) fn coarse_size(&self) -> [usize; 2] {
        [self.width.div_ceil(COARSE), self.height.div_ceil(COARSE)]
    }

    /// A point of the surface in the camera's frame.
    pub(crate) fn seen(&self, point: &Point3<f32>) -> Point3<f64> {
        self.camera_from_surface * point.cast::<f64>()
    }

    /// Where the camera stands in the surface's frame.
    pub(crate) fn eye(&self) -> Point3<f64> {
        self.camera_from_surface.inverse() * Point3::origin()
    }

    /// A direction on the surface in the room.
    pub(crate) fn in_room(&self, normal: &Vector3<f32>) -> Vector3<f32> {
        self.room_from_surface.cast::<f32>() * normal
    }
}

/// First pixel, columns and rows of the part of a picture in which the mesh can lie.
fn bounds(mesh: &Mesh, camera: &PinholeCamera, camera_from_surface: &Rigid) -> Option<([usize; 2], usize, usize)> {
    let (mut lo, mut hi) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for pixel in mesh.positions.iter().filter_map(|p| camera.project(&(camera_from_surface * p.cast::<f64>()))) {
        for k in 0..2 {
            lo[k] = lo[k].min(pixel[k]);
            hi[k] = hi[k].max(pixel[k]);
        }
    }
    let range = |k: usize, size: u32| {
        let first = (lo[k] - MARGIN).floor().max(0.0) as usize;
        let last = (hi[k] + MARGIN).ceil().min(f64::from(size) - 1.0);
        (last >= first as f64 + 8.0).then(|| (first, last as usize + 1 - first))
    };
    let ((u, width), (v, height)) = (range(0, camera.width)?, range(1, camera.height)?);
    Some(([u, v], width, height))
}

/// A part of a picture in linear light, 0 to 1.
fn crop(image: &RgbImage, corner: [usize; 2], width: usize, height: usize) -> Vec<[f32; 3]> {
    let table: [f32; 256] = std::array::from_fn(|value| linear_of_srgb(value as f32 / 255.0));
    let row = |v: usize| {
        let first = (corner[1] + v) * image.width as usize + corner[0];
        image.pixels[first..first + width].iter().map(|rgb| rgb.map(|c| table[usize::from(c)]))
    };
    (0..height).flat_map(row).collect()
}

/// Mean of squares of pixels.
fn coarse(pixels: &[[f32; 3]], width: usize, height: usize) -> Vec<[f32; 3]> {
    let (columns, rows) = (width.div_ceil(COARSE), height.div_ceil(COARSE));
    let mean = |i: usize| {
        let (x, y) = (i % columns * COARSE, i / columns * COARSE);
        let (mut sum, mut count) = ([0.0f32; 3], 0.0f32);
        for v in y..(y + COARSE).min(height) {
            for pixel in &pixels[v * width + x..v * width + (x + COARSE).min(width)] {
                (0..3).for_each(|k| sum[k] += pixel[k]);
                count += 1.0;
            }
        }
        sum.map(|s| s / count.max(1.0))
    };
    (0..columns * rows).map(mean).collect()
}

/// IEC 61966-2-1, decoding: 0 to 1.
pub(crate) fn linear_of_srgb(c: f32) -> f32 {
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

/// IEC 61966-2-1, encoding: 0 to 1.
pub(crate) fn srgb_of_linear(c: f32) -> f32 {
    if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 }
}

/// Decodes all pictures that show the mesh, in their order.
///
/// # Errors
/// [`TextureError::Size`] of the first of a wrong size; [`TextureError::NothingSeen`] where none shows the surface.
pub(crate) fn shots(photos: &[Photo], mesh: &Mesh) -> Result<Vec<Shot>, TextureError> {
    let all: Vec<Result<Option<Shot>, TextureError>> = photos.par_iter().map(|photo| Shot::new(photo, mesh)).collect();
    // One after the other, so that the error is that of the first picture for any number of threads.
    let shots: Vec<Shot> = all.into_iter().filter_map(Result::transpose).collect::<Result<_, _>>()?;
    if shots.is_empty() { Err(TextureError::NothingSeen { photos: photos.len() }) } else { Ok(shots) }
}
