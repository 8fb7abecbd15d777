//! How large a texture the pictures are worth.

use nalgebra::Point3;
use toile_geometry::Mesh;

use crate::{Photo, TextureSettings};

/// Texels that a pixel of the pictures is worth: detail between pixels comes from several pictures.
const TEXELS_A_PIXEL: f64 = 3.0;
/// Nobody looks closer, metres a texel.
const FINE_ENOUGH: f64 = 0.0005;
/// Share of the texture that charts cover, about.
const COVERED: f64 = 0.6;

/// The smallest size at which a texel is fine enough for the pictures, at most `settings.size`.
pub fn fitting_size(mesh: &Mesh, photos: &[Photo], settings: &TextureSettings) -> u32 {
    let Some((lo, hi)) = mesh.bounds() else { return settings.size };
    let middle: Point3<f64> = nalgebra::center(&lo, &hi).cast();
    let pixel = |photo: &Photo| (photo.camera_from_surface * middle).z.max(0.1) / photo.camera.fx;
    let finest = photos.iter().map(pixel).fold(f64::INFINITY, f64::min);
    let wanted = (finest / TEXELS_A_PIXEL).max(FINE_ENOUGH);
    let texel = |size: u32| (mesh.area() / COVERED).sqrt() / f64::from(size);
    let sizes = TextureSettings::SIZES.into_iter().filter(|&size| size <= settings.size);
    sizes.into_iter().find(|&size| texel(size) <= wanted).unwrap_or(settings.size)
}
