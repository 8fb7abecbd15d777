//! Textures as files.

use image::{ExtendedColorType, ImageEncoder, codecs::png};
use jpeg_encoder::{ColorType, Encoder, SamplingFactor};

use crate::{Texture, TextureError};

/// Quality of JPEG textures: the error of a texel is below the noise of the pictures.
const QUALITY: u8 = 96;

impl Texture {
    /// The texture as a JPEG, colours at full resolution.
    ///
    /// # Errors
    /// [`TextureError::Encode`].
    pub fn to_jpeg(&self) -> Result<Vec<u8>, TextureError> {
        encode_rgb_jpeg(&self.pixels, self.size)
    }

    /// The texture as a PNG.
    ///
    /// # Errors
    /// [`TextureError::Encode`].
    pub fn to_png(&self) -> Result<Vec<u8>, TextureError> {
        encode_png(&self.pixels, self.size)
    }

    /// What was seen, as a grey PNG: 255 seen, 128 filled, 0 between charts.
    ///
    /// # Errors
    /// [`TextureError::Encode`].
    pub fn seen_to_png(&self) -> Result<Vec<u8>, TextureError> {
        png(&self.seen, self.size, ExtendedColorType::L8, png::FilterType::NoFilter)
    }
}

/// A square picture of `size` texels along an edge as a JPEG, colours at full resolution.
///
/// # Errors
/// [`TextureError::Encode`].
pub fn encode_rgb_jpeg(pixels: &[[u8; 3]], size: u32) -> Result<Vec<u8>, TextureError> {
    let wrong = |error: jpeg_encoder::EncodingError| TextureError::Encode(error.to_string());
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, QUALITY);
    encoder.set_sampling_factor(SamplingFactor::R_4_4_4);
    let size = u16::try_from(size).map_err(|_| TextureError::Encode("it is too large for a JPEG".into()))?;
    encoder.encode(pixels.as_flattened(), size, size, ColorType::Rgb).map_err(wrong)?;
    Ok(bytes)
}

/// The same as a PNG.
///
/// # Errors
/// [`TextureError::Encode`].
pub fn encode_png(pixels: &[[u8; 3]], size: u32) -> Result<Vec<u8>, TextureError> {
    png(pixels.as_flattened(), size, ExtendedColorType::Rgb8, png::FilterType::Paeth)
}

/// A square picture as a PNG file.
fn png(bytes: &[u8], size: u32, kind: ExtendedColorType, filter: png::FilterType) -> Result<Vec<u8>, TextureError> {
    let mut file = Vec::new();
    png::PngEncoder::new_with_quality(&mut file, png::CompressionType::Fast, filter)
        .write_image(bytes, size, size, kind)
        .map_err(|error| TextureError::Encode(error.to_string()))?;
    Ok(file)
}
