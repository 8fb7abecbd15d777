//! Depth and colour of one sensor at one time.

use std::sync::Arc;

use crate::CaptureError;

/// A depth image in the sensor's units; 0 where nothing was measured.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DepthImage {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Row by row; metres are `value * Sensor::depth_scale`.
    pub values: Vec<u16>,
}

impl DepthImage {
    /// Value at column `u`, row `v`; 0 outside.
    #[inline]
    pub fn at(&self, u: u32, v: u32) -> u16 {
        if u < self.width && v < self.height { self.values[(v * self.width + u) as usize] } else { 0 }
    }
}

/// An 8-bit sRGB image, row by row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RgbImage {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Pixels, row by row.
    pub pixels: Vec<[u8; 3]>,
}

/// A colour image as the device gave it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ColorImage {
    /// The device's own JPEG, kept byte by byte.
    Jpeg(Arc<[u8]>),
    /// A PNG file's bytes.
    Png(Arc<[u8]>),
    /// Raw pixels.
    Rgb(Arc<RgbImage>),
}

/// What one sensor saw at one time. Cheap to clone.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Which sensor of the rig, by index.
    pub sensor: usize,
    /// Position in the source, from 0.
    pub index: u64,
    /// The device's own frame number.
    pub device_frame: u64,
    /// Frames of this sensor lost since the one before (by the device's numbers).
    pub lost_before: u32,
    /// Device clock, nanoseconds, of the depth exposure (of the colour where there is no depth). Never rebased.
    pub device_time_ns: i64,
    /// Host clock (Unix), nanoseconds, of arrival; for imported frames the same as the device time.
    pub host_time_ns: i64,
    /// Depth, or `None` where only colour came.
    pub depth: Option<Arc<DepthImage>>,
    /// Colour, or `None` where only depth came.
    pub color: Option<ColorImage>,
}

impl ColorImage {
    /// Decodes to pixels.
    ///
    /// # Errors
    /// [`CaptureError::Frame`] (with `index`) where the bytes are no such image.
    pub fn decode(&self, index: u64) -> Result<Arc<RgbImage>, CaptureError> {
        let wrong = |reason: String| CaptureError::Frame { index, reason };
        match self {
            Self::Rgb(image) => Ok(image.clone()),
            Self::Jpeg(bytes) => decode_jpeg(bytes).map(Arc::new).map_err(wrong),
            Self::Png(bytes) => decode_png(bytes).map(Arc::new).map_err(wrong),
        }
    }
}

fn decode_jpeg(bytes: &[u8]) -> Result<RgbImage, String> {
    use zune_jpeg::{JpegDecoder, zune_core::bytestream::ZCursor};
    let mut decoder = JpegDecoder::new(ZCursor::new(bytes));
    let flat = decoder.decode().map_err(|e| format!("the colour image is no readable JPEG: {e}"))?;
    let (width, height) = decoder.dimensions().ok_or("the JPEG has no size")?;
    let count = width * height;
    let pixels = match flat.len() {
        n if n == count * 3 => flat.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
        n if n == count => flat.iter().map(|&g| [g; 3]).collect(),
        n => return Err(format!("the JPEG has {n} bytes for {count} pixels")),
    };
    Ok(RgbImage { width: width as u32, height: height as u32, pixels })
}

fn decode_png(bytes: &[u8]) -> Result<RgbImage, String> {
    let image = image::load_from_memory_with_format(bytes, image::ImageFormat::Png)
        .map_err(|e| format!("the colour image is no readable PNG: {e}"))?
        .to_rgb8();
    Ok(RgbImage { width: image.width(), height: image.height(), pixels: image.pixels().map(|p| p.0).collect() })
}
