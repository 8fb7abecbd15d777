//! Moving pictures.

use image::{
    DynamicImage, Frame, RgbImage,
    codecs::gif::{GifEncoder, Repeat},
    imageops::FilterType,
};

use crate::RenderError;

/// How much work goes into the palette of a picture, from 1 (most) to 30.
const SPEED: i32 = 10;

/// The bytes of an animated GIF that shows `frames` for `milliseconds` each, again and again. Where it would have more than `limit` bytes,
/// the pictures are made smaller.
///
/// # Errors
/// [`RenderError::Encode`] where a picture has no pixels.
pub fn gif(frames: &[RgbImage], milliseconds: u32, limit: usize) -> Result<Vec<u8>, RenderError> {
    let mut bytes = encoded(frames, milliseconds)?;
    let mut share = 1.0f64;
    while bytes.len() > limit && share > 0.1 {
        share *= 0.8;
        let smaller = |frame: &RgbImage| {
            let side = |pixels: u32| ((f64::from(pixels) * share) as u32).max(1);
            image::imageops::resize(frame, side(frame.width()), side(frame.height()), FilterType::Triangle)
        };
        bytes = encoded(&frames.iter().map(smaller).collect::<Vec<_>>(), milliseconds)?;
    }
    Ok(bytes)
}

fn encoded(frames: &[RgbImage], milliseconds: u32) -> Result<Vec<u8>, RenderError> {
    let mut bytes = Vec::new();
    let mut encoder = GifEncoder::new_with_speed(&mut bytes, SPEED);
    encoder.set_repeat(Repeat::Infinite)?;
    for frame in frames {
        let delay = image::Delay::from_numer_denom_ms(milliseconds, 1);
        let picture = DynamicImage::from(frame.clone()).into_rgba8();
        encoder.encode_frame(Frame::from_parts(picture, 0, 0, delay))?;
    }
    drop(encoder);
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use image::{AnimationDecoder, Rgb, codecs::gif::GifDecoder};

    use super::*;

    #[test]
    fn a_film_has_all_its_pictures_and_keeps_its_limit() {
        let noise = |k: u32| {
            RgbImage::from_fn(80, 60, |x, y| Rgb([(x * 7 + y * 13 + k * 31) as u8, (x * y + k) as u8, (x ^ y) as u8]))
        };
        let frames: Vec<RgbImage> = (0..5).map(noise).collect();
        let read = |bytes: &[u8]| {
            let frames = GifDecoder::new(std::io::Cursor::new(bytes.to_vec())).unwrap().into_frames();
            frames.collect_frames().unwrap()
        };
        let whole = gif(&frames, 80, usize::MAX).unwrap();
        let pictures = read(&whole);
        assert_eq!((pictures.len(), pictures[0].buffer().width()), (5, 80));
        assert_eq!(pictures[0].delay().numer_denom_ms(), (80, 1));
        let small = gif(&frames, 80, whole.len() / 2).unwrap();
        assert!(small.len() <= whole.len() / 2 && read(&small).len() == 5);
    }
}
