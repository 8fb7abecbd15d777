//! Grey images: what the matcher compares.

use toile_capture::RgbImage;

/// An 8-bit grey image, row by row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GrayImage {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Pixels, row by row.
    pub pixels: Vec<u8>,
}

impl GrayImage {
    /// Row `v`.
    ///
    /// # Panics
    /// Where `v` is not below the height.
    #[inline]
    pub fn row(&self, v: usize) -> &[u8] {
        &self.pixels[v * self.width as usize..][..self.width as usize]
    }

    /// True when the image has pixels, and as many as its size says.
    pub fn is_valid(&self) -> bool {
        !self.pixels.is_empty() && self.pixels.len() == self.width as usize * self.height as usize
    }
}

/// Luma of an sRGB image by the weights of ITU-R BT.601, which the JPEGs of cameras are made with.
pub fn luma(image: &RgbImage) -> GrayImage {
    let gray = |&[r, g, b]: &[u8; 3]| {
        // 0.299, 0.587 and 0.114 in 1/16384; the sum of the three is exactly one.
        ((4899 * u32::from(r) + 9617 * u32::from(g) + 1868 * u32::from(b) + 8192) >> 14) as u8
    };
    GrayImage { width: image.width, height: image.height, pixels: image.pixels.iter().map(gray).collect() }
}
