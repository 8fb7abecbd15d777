//! Depth and colour of one sensor at one time.

use std::sync::Arc;

use crate::{
    CaptureError, encoded,
    picture::{DepthImage, RgbImage},
};

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

/// The images of one sensor at one time. Cheap to clone.
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
    /// Decodes to pixels. Of a JPEG that is damaged behind its header, the part that can be read is given.
    ///
    /// # Errors
    /// [`CaptureError::Frame`] (with `index`) where the bytes are not such an image.
    pub fn decode(&self, index: u64) -> Result<Arc<RgbImage>, CaptureError> {
        let wrong = |reason: String| CaptureError::Frame { index, reason: format!("the colour image {reason}") };
        match self {
            Self::Rgb(image) => Ok(image.clone()),
            Self::Jpeg(bytes) => encoded::decode_jpeg(bytes, false).map(Arc::new).map_err(wrong),
            Self::Png(bytes) => encoded::decode_color_png(bytes).map(Arc::new).map_err(wrong),
        }
    }

    /// True where its file ends as it should, seen from its markers alone and therefore fast; some damage is not seen.
    pub fn is_sound(&self) -> bool {
        match self {
            Self::Rgb(_) => true,
            Self::Jpeg(bytes) => encoded::has_sound_markers(bytes),
            Self::Png(bytes) => encoded::has_sound_chunks(bytes),
        }
    }

    /// Decodes the whole image to see whether it is whole; gives its columns and rows.
    ///
    /// # Errors
    /// The problem.
    pub(crate) fn check(&self) -> Result<(u32, u32), String> {
        let image = match self {
            Self::Rgb(image) => return Ok((image.width, image.height)),
            Self::Jpeg(bytes) => encoded::decode_jpeg(bytes, true)?,
            Self::Png(bytes) => encoded::decode_color_png(bytes)?,
        };
        Ok((image.width, image.height))
    }
}

/// An image from `rgb8` bytes; `None` where their number does not fit.
pub(crate) fn rgb_image(width: u32, height: u32, bytes: &[u8]) -> Option<ColorImage> {
    let (pixels, rest) = bytes.as_chunks::<3>();
    let fits = rest.is_empty() && pixels.len() as u64 == u64::from(width) * u64::from(height);
    fits.then(|| ColorImage::Rgb(Arc::new(RgbImage { width, height, pixels: pixels.to_vec() })))
}
