//! Pictures side by side, and legends.

use image::{Rgb, RgbImage, imageops};

use crate::{RenderError, colormap, label, picture::BACKGROUND};

/// Colour of text.
const INK: [u8; 3] = [40, 40, 44];
/// Free pixels between tiles.
const GAP: u32 = 6;
/// Pixels a dot of a letter.
const SCALE: u32 = 2;

/// Tiles in rows of `columns`, each with its label above it. Tiles may differ in size: every cell is as large as the
/// largest. Without any label there is no line for labels.
///
/// # Errors
/// [`RenderError::Empty`] without tiles.
pub fn contact_sheet(tiles: &[(String, RgbImage)], columns: usize) -> Result<RgbImage, RenderError> {
    let width = tiles.iter().map(|t| t.1.width()).max().filter(|&w| w > 0);
    let (Some(width), columns) = (width, columns.clamp(1, tiles.len().max(1))) else {
        return Err(RenderError::Empty("a contact sheet needs at least one picture".into()));
    };
    let height = tiles.iter().map(|t| t.1.height()).max().unwrap_or(0);
    let text = if tiles.iter().all(|t| t.0.is_empty()) { 0 } else { label::height(SCALE) + GAP };
    let rows = tiles.len().div_ceil(columns) as u32;
    let (cell_width, cell_height) = (width + GAP, height + text + GAP);
    let mut sheet = RgbImage::from_pixel(columns as u32 * cell_width + GAP, rows * cell_height + GAP, Rgb(BACKGROUND));
    for (i, (name, tile)) in tiles.iter().enumerate() {
        let (x, y) = ((i % columns) as u32 * cell_width + GAP, (i / columns) as u32 * cell_height + GAP);
        let fitting: String = name.chars().take((width / label::width("x", SCALE)) as usize).collect();
        label::draw(&mut sheet, x, y, &fitting, SCALE, INK);
        imageops::replace(&mut sheet, tile, i64::from(x), i64::from(y + text));
    }
    Ok(sheet)
}

/// The picture with a colour scale under it: the ends of `range` and its unit, such as `mm`.
pub fn scale_bar(picture: &RgbImage, range: (f32, f32), unit: &str) -> RgbImage {
    let bar = label::height(SCALE);
    let mut out = RgbImage::from_pixel(picture.width(), picture.height() + 2 * bar + 3 * GAP, Rgb(BACKGROUND));
    imageops::replace(&mut out, picture, 0, 0);
    let top = picture.height() + GAP;
    let length = picture.width().saturating_sub(2 * GAP).max(1);
    for u in 0..length.min(picture.width()) {
        let color = colormap::viridis(u as f32 / length as f32, (0.0, 1.0));
        (top..top + bar).for_each(|v| out.put_pixel((GAP + u).min(picture.width() - 1), v, Rgb(color)));
    }
    let (low, high) = (short(range.0), format!("{} {unit}", short(range.1)));
    let right = (picture.width().saturating_sub(GAP)).saturating_sub(label::width(&high, SCALE));
    label::draw(&mut out, GAP, top + bar + GAP, &low, SCALE, INK);
    label::draw(&mut out, right, top + bar + GAP, &high, SCALE, INK);
    out
}

/// A number in a few characters.
fn short(value: f32) -> String {
    let digits = match value.abs() {
        v if v >= 100.0 || v == v.round() => 0,
        v if v >= 1.0 => 1,
        _ => 3,
    };
    format!("{value:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_keep_their_pixels_and_labels_leave_ink() {
        let tile = RgbImage::from_pixel(60, 20, Rgb([1, 2, 3]));
        let sheet = contact_sheet(&[("a 1".into(), tile.clone()), ("b".into(), tile.clone())], 2).unwrap();
        let count = |c: [u8; 3]| sheet.pixels().filter(|p| p.0 == c).count();
        assert_eq!(count([1, 2, 3]), 2 * 60 * 20);
        assert!(count(INK) > 50);
        assert!(contact_sheet(&[], 2).is_err());
        assert_eq!(scale_bar(&tile, (0.0, 5.0), "mm").width(), 60);
        assert_eq!(short(0.25), "0.250");
    }
}
