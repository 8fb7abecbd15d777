//! Encoded images: their sizes, and decoding them with bounded memory.

use std::io::Cursor;

use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits, codecs::png::PngDecoder};
use zune_jpeg::{
    JpegDecoder,
    zune_core::{bytestream::ZCursor, options::DecoderOptions},
};

use crate::picture::{DepthImage, RgbImage};

/// The maximum number of pixels of a colour image: 8K video has 33.2 million.
pub(crate) const MAX_COLOR_PIXELS: u64 = 1 << 25;
/// The maximum number of bytes that decoding a PNG may take: 16-bit grey of 64 Mi pixels.
const MAX_PNG_BYTES: u64 = 128 << 20;
/// Columns and rows are never more than this.
const MAX_SIDE: u32 = 16_384;

/// True for the bytes of a PNG file.
pub(crate) fn is_png(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\x89PNG\r\n\x1a\n")
}

/// True for a PNG of 16-bit grey, which depth comes in.
pub(crate) fn is_deep_grey_png(bytes: &[u8]) -> bool {
    png_decoder(bytes).is_ok_and(|decoder| decoder.color_type() == image::ColorType::L16)
}

/// Columns and rows of a JPEG or PNG, from its header alone.
///
/// # Errors
/// A sentence that says what is wrong with the file.
pub(crate) fn size(bytes: &[u8]) -> Result<(u32, u32), String> {
    if is_png(bytes) {
        return png_decoder(bytes).map(|decoder| decoder.dimensions());
    }
    let mut decoder = JpegDecoder::new(ZCursor::new(bytes));
    decoder.decode_headers().map_err(|error| format!("is neither a readable JPEG nor a PNG: {error}"))?;
    let (width, height) = decoder.dimensions().ok_or("the JPEG does not say its size")?;
    Ok((width as u32, height as u32))
}

/// Decodes a 16-bit grey PNG.
///
/// # Errors
/// As [`size`]; also where it is of another kind.
pub(crate) fn decode_depth_png(bytes: &[u8]) -> Result<DepthImage, String> {
    match decode_png(bytes)? {
        DynamicImage::ImageLuma16(image) => {
            Ok(DepthImage { width: image.width(), height: image.height(), values: image.into_raw() })
        }
        other => Err(format!("depth must be a 16-bit grey PNG, but this one is {:?}", other.color())),
    }
}

/// Decodes a colour PNG.
///
/// # Errors
/// As [`size`].
pub(crate) fn decode_color_png(bytes: &[u8]) -> Result<RgbImage, String> {
    check_color_size(size(bytes)?)?;
    let image = decode_png(bytes)?.to_rgb8();
    Ok(RgbImage { width: image.width(), height: image.height(), pixels: image.pixels().map(|p| p.0).collect() })
}

/// Decodes a JPEG. With `strict`, one that is damaged or cut off behind its header is refused; otherwise the part that
/// can be read is given, and the rest is grey.
///
/// # Errors
/// As [`size`].
pub(crate) fn decode_jpeg(bytes: &[u8], strict: bool) -> Result<RgbImage, String> {
    check_color_size(size(bytes)?)?;
    if strict && !has_sound_markers(bytes) {
        return Err("is damaged or cut off: a marker is missing, or where none should be".to_string());
    }
    let options = DecoderOptions::default().set_strict_mode(strict);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    let flat = decoder.decode().map_err(|error| format!("is not a readable JPEG: {error}"))?;
    let (width, height) = decoder.dimensions().ok_or("the JPEG does not say its size")?;
    let count = width * height;
    let pixels = match flat.len() {
        n if n == count * 3 => flat.as_chunks::<3>().0.to_vec(),
        n if n == count => flat.iter().map(|&grey| [grey; 3]).collect(),
        n => return Err(format!("the JPEG has {n} bytes for {count} pixels")),
    };
    Ok(RgbImage { width: width as u32, height: height as u32, pixels })
}

/// True where a JPEG's markers follow each other as they should, up to its end marker; some cameras send padding behind
/// that. Bits that were changed inside of a scan mostly look like markers that have no place there.
pub(crate) fn has_sound_markers(bytes: &[u8]) -> bool {
    let (mut rest, mut has_restarts) = (bytes.strip_prefix(&[0xff, 0xd8]).unwrap_or_default(), false);
    while let [0xff, marker, behind @ ..] = rest {
        match marker {
            0xd9 => return true,
            0xff => rest = &rest[1..],
            0x00 | 0x01 | 0xd0..=0xd8 => return false,
            _ => {
                let length = behind.first_chunk::<2>().map_or(0, |&length| usize::from(u16::from_be_bytes(length)));
                let Some((segment, following)) = behind.split_at_checked(length).filter(|_| length >= 2) else {
                    return false;
                };
                has_restarts |= *marker == 0xdd && segment[2..].iter().any(|byte| *byte != 0);
                rest = if *marker == 0xda { behind_scan(following, has_restarts) } else { following };
            }
        }
    }
    false
}

/// True where a PNG's pieces follow each other with the right sums, up to the last one.
pub(crate) fn has_sound_chunks(bytes: &[u8]) -> bool {
    let mut rest = bytes.get(8..).unwrap_or_default();
    while let Some((length, behind)) = rest.split_first_chunk::<4>() {
        let length = u32::from_be_bytes(*length) as usize;
        let Some((chunk, sum)) = length.checked_add(4).and_then(|length| behind.split_at_checked(length)) else {
            return false;
        };
        let Some((sum, following)) = sum.split_first_chunk::<4>() else { return false };
        if crc32fast::hash(chunk) != u32::from_be_bytes(*sum) {
            return false;
        }
        if chunk.starts_with(b"IEND") {
            return true;
        }
        rest = following;
    }
    false
}

/// The bytes after the bits of a scan: the first marker that is not part of them; nothing where there is none.
fn behind_scan(bytes: &[u8], has_restarts: bool) -> &[u8] {
    let mut rest = bytes;
    while let Some(at) = rest.iter().position(|byte| *byte == 0xff) {
        rest = &rest[at..];
        match rest.get(1) {
            Some(0x00) => rest = &rest[2..],
            Some(0xd0..=0xd7) if has_restarts => rest = &rest[2..],
            _ => return rest,
        }
    }
    &[]
}

/// Decodes an image of any kind that masks come in.
///
/// # Errors
/// As [`size`].
pub(crate) fn decode_mask(bytes: &[u8]) -> Result<image::GrayImage, String> {
    check_color_size(size(bytes)?)?;
    if is_png(bytes) {
        return Ok(decode_png(bytes)?.to_luma8());
    }
    image::load_from_memory(bytes).map(|image| image.to_luma8()).map_err(|error| format!("is not a mask: {error}"))
}

fn check_color_size((width, height): (u32, u32)) -> Result<(), String> {
    if u64::from(width) * u64::from(height) <= MAX_COLOR_PIXELS {
        return Ok(());
    }
    Err(format!("{width} x {height} pixels are more than the {MAX_COLOR_PIXELS} that are decoded"))
}

fn decode_png(bytes: &[u8]) -> Result<DynamicImage, String> {
    let mut reader = ImageReader::with_format(Cursor::new(bytes), ImageFormat::Png);
    reader.limits(limits());
    reader.decode().map_err(|error| format!("is not a readable PNG: {error}"))
}

fn png_decoder(bytes: &[u8]) -> Result<PngDecoder<Cursor<&[u8]>>, String> {
    PngDecoder::with_limits(Cursor::new(bytes), limits()).map_err(|error| format!("is not a readable PNG: {error}"))
}

fn limits() -> Limits {
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_PNG_BYTES);
    limits
}
