//! Pixels of `sensor_msgs`: raw rows or compressed pictures.

use std::sync::Arc;

use super::messages::Image;
use crate::{
    ColorImage, DepthImage, RgbImage, encoded,
    import::stored::millimetres,
    pixels::{Rows, yuyv},
};

/// The largest number of pixels of a raw picture.
const MAX_PIXELS: u64 = 1 << 26;
/// Bytes before the PNG in messages of `compressed_depth_image_transport`: a format and two parameters.
const CONFIG: usize = 12;

/// Columns and rows of a compressed picture.
pub(super) fn compressed_size(image: &Image) -> Option<(u32, u32)> {
    encoded::size(picture(image)).ok()
}

/// The bytes of the JPEG or PNG itself.
fn picture<'a>(image: &Image<'a>) -> &'a [u8] {
    let is_depth = image.encoding.to_ascii_lowercase().contains("compresseddepth");
    match image.data.get(CONFIG..).filter(|rest| is_depth && encoded::is_png(rest)) {
        Some(png) => png,
        None => image.data,
    }
}

/// A depth image in its own units; `32FC1` in millimetres.
///
/// # Errors
/// What is wrong with it.
pub(super) fn depth(image: &Image) -> Result<DepthImage, String> {
    if image.size == (0, 0) {
        let encoding = image.encoding.to_ascii_lowercase();
        if encoding.starts_with("32fc1") {
            return Err("is compressed 32FC1, which keeps few bits; record 16UC1".into());
        }
        return encoded::decode_depth_png(picture(image));
    }
    let rows = rows(image)?;
    let is_float = image.encoding.eq_ignore_ascii_case("32FC1");
    let size = if is_float { 4 } else { 2 };
    let big = image.is_big_endian;
    let value = |b: &[u8]| match (is_float, big) {
        (true, false) => millimetres(f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        (true, true) => millimetres(f32::from_be_bytes([b[0], b[1], b[2], b[3]])),
        (false, false) => u16::from_le_bytes([b[0], b[1]]),
        (false, true) => u16::from_be_bytes([b[0], b[1]]),
    };
    let of_rows = rows.of(image.data, size).map_err(|error| error.to_string())?;
    let values = of_rows.flat_map(|row| row.chunks_exact(size).map(value)).collect();
    Ok(DepthImage { width: rows.width, height: rows.height, values })
}

/// A colour image. `yuv422` is UYVY for ROS, but YUYV in the recordings of librealsense.
///
/// # Errors
/// What is wrong with it.
pub(super) fn color(image: &Image, is_librealsense: bool) -> Result<ColorImage, String> {
    if image.size == (0, 0) {
        encoded::size(image.data)?;
        let bytes = image.data.into();
        return Ok(if encoded::is_png(image.data) { ColorImage::Png(bytes) } else { ColorImage::Jpeg(bytes) });
    }
    let rows = rows(image)?;
    let encoding = image.encoding.to_ascii_lowercase();
    if matches!(encoding.as_str(), "yuv422" | "yuv422_yuy2" | "yuyv" | "uyvy") {
        let is_uyvy = encoding == "uyvy" || (encoding == "yuv422" && !is_librealsense);
        let swapped: Vec<u8>;
        let bytes = if is_uyvy {
            swapped = image.data.as_chunks::<2>().0.iter().flat_map(|[a, b]| [*b, *a]).collect();
            swapped.as_slice()
        } else {
            image.data
        };
        return yuyv(bytes, rows).map(|image| ColorImage::Rgb(Arc::new(image))).map_err(|error| error.to_string());
    }
    let (size, order) = match encoding.as_str() {
        "rgb8" => (3, [0, 1, 2]),
        "bgr8" => (3, [2, 1, 0]),
        "rgba8" => (4, [0, 1, 2]),
        "bgra8" => (4, [2, 1, 0]),
        _ => return Err(format!("has the encoding `{}`, which is not read", crate::printable(image.encoding))),
    };
    let of_rows = rows.of(image.data, size).map_err(|error| error.to_string())?;
    let pixels = of_rows.flat_map(|row| row.chunks_exact(size).map(|p| order.map(|k| p[k]))).collect();
    Ok(ColorImage::Rgb(Arc::new(RgbImage { width: rows.width, height: rows.height, pixels })))
}

fn rows(image: &Image) -> Result<Rows, String> {
    let (width, height) = image.size;
    if width == 0 || height == 0 || u64::from(width) * u64::from(height) > MAX_PIXELS {
        return Err(format!("has {width} x {height} pixels, which no picture has that is read"));
    }
    Ok(Rows { width, height, stride: image.step })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_of_four_billion_empty_rows_is_refused_at_once() {
        let image = |width: u32, height: u32| Image {
            time_ns: 0,
            frame_id: "",
            size: (width, height),
            encoding: "16UC1",
            is_big_endian: false,
            step: 0,
            data: &[],
        };
        for (width, height) in [(0, u32::MAX), (u32::MAX, 0), (u32::MAX, u32::MAX)] {
            assert!(depth(&image(width, height)).unwrap_err().contains("which no picture has"), "{width} x {height}");
            assert!(color(&Image { encoding: "rgb8", ..image(width, height) }, false).is_err());
        }
    }
}
