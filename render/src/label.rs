//! Small text in pictures.

use image::{Rgb, RgbImage};

use crate::font::{GLYPH_HEIGHT, GLYPH_WIDTH, glyph};

/// Width of a text in pixels at `scale`.
pub fn width(text: &str, scale: u32) -> u32 {
    text.chars().count() as u32 * (GLYPH_WIDTH + 1) * scale
}

/// Height of a line of text in pixels at `scale`.
pub fn height(scale: u32) -> u32 {
    GLYPH_HEIGHT * scale
}

/// Draws a line of text with its top left corner at (x, y); letters are capitals of 5 × 7 squares of `scale` pixels. Pixels
/// outside the picture are left out.
pub fn draw(image: &mut RgbImage, x: u32, y: u32, text: &str, scale: u32, color: [u8; 3]) {
    for (i, character) in text.chars().enumerate() {
        let rows = glyph(character);
        let left = x + i as u32 * (GLYPH_WIDTH + 1) * scale;
        for v in 0..GLYPH_HEIGHT * scale {
            for u in 0..GLYPH_WIDTH * scale {
                let on = rows[(v / scale) as usize] >> (GLYPH_WIDTH - 1 - u / scale) & 1 == 1;
                if on && left + u < image.width() && y + v < image.height() {
                    image.put_pixel(left + u, y + v, Rgb(color));
                }
            }
        }
    }
}
