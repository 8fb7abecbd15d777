//! Depth and colour as pixels.

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
