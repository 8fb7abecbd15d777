//! Image messages to images.

use super::{depth_codec, message::ImageMessage, schema::Schema};
use crate::{
    ColorImage, DepthImage,
    encoded::{self, is_png},
    frame::rgb_image,
};

/// Depth from a message; its size must be the calibration's.
pub(super) fn decode_depth(schema: Schema, bytes: &[u8], size: (u32, u32)) -> Result<DepthImage, String> {
    let message = ImageMessage::decode(schema, bytes).ok_or("its depth message is not readable")?;
    let (width, height) = match schema {
        Schema::CompressedDepth => depth_codec::size(message.data).map_err(|error| error.to_string())?,
        Schema::CompressedImage => encoded::size(message.data)?,
        _ => (message.width, message.height),
    };
    if (width, height) != size {
        return Err(format!("the depth has {width} x {height} pixels, the calibration says {} x {}", size.0, size.1));
    }
    match (schema, message.format) {
        (Schema::CompressedDepth, depth_codec::NAME) => {
            depth_codec::decode(message.data).map_err(|error| error.to_string())
        }
        (Schema::CompressedImage, _) if is_png(message.data) => encoded::decode_depth_png(message.data),
        (Schema::RawImage, "16UC1" | "mono16") => raw_depth(&message),
        (_, format) => Err(format!("depth in the format `{format}` cannot be read")),
    }
}

/// Colour from a message. Compressed images keep their bytes.
pub(super) fn decode_color(schema: Schema, bytes: &[u8]) -> Result<ColorImage, String> {
    let message = ImageMessage::decode(schema, bytes).ok_or("its colour message is not readable")?;
    let image = match (schema, message.format) {
        (Schema::CompressedImage, "png") => Some(ColorImage::Png(message.data.into())),
        (Schema::CompressedImage, format) if format.contains("jp") => Some(ColorImage::Jpeg(message.data.into())),
        (Schema::RawImage, "rgb8") => rgb_image(message.width, message.height, message.data),
        (Schema::RawImage, "bgr8") => {
            let swapped: Vec<u8> = message.data.as_chunks::<3>().0.iter().flat_map(|&[b, g, r]| [r, g, b]).collect();
            rgb_image(message.width, message.height, &swapped)
        }
        _ => None,
    };
    image.ok_or_else(|| format!("colour in the format `{}` cannot be read", message.format))
}

/// Rows of little-endian values, which may be followed by padding.
fn raw_depth(message: &ImageMessage) -> Result<DepthImage, String> {
    let (width, height) = (message.width, message.height);
    let (row, step) = (2 * width as usize, (message.step as usize).max(2 * width as usize));
    let needed = step.checked_mul(height as usize).filter(|&needed| needed <= message.data.len() && row > 0);
    if needed.is_none() {
        let count = message.data.len();
        return Err(format!("the depth has {count} bytes, which is not enough for {width} x {height} pixels"));
    }
    let rows = message.data.chunks(step).take(height as usize);
    let values = rows.flat_map(|padded| padded[..row].as_chunks::<2>().0).map(|&pair| u16::from_le_bytes(pair));
    Ok(DepthImage { width, height, values: values.collect() })
}
