//! How textures are made.

use serde::{Deserialize, Serialize};

use crate::TextureError;

/// How textures are made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TextureSettings {
    /// Edge of the picture, texels: 1024, 2048, 4096 or 8192; 0 makes no texture. Default 4096.
    pub size: u32,
    /// Empty texels around each chart, for filtering and mip levels, at 4096 texels; in proportion at other sizes. Default 2.
    pub padding: u32,
    /// At most this many pictures are blended at a vertex. Default 6.
    pub blended: u32,
    /// At most this many pictures of a take are used, evenly spread. Default 120.
    pub photos: u32,
    /// Whether the light of the room is taken out, so that the texture shows the surface's own colours. Default true.
    pub even_light: bool,
}

impl Default for TextureSettings {
    fn default() -> Self {
        Self { size: 4096, padding: 2, blended: 6, photos: 120, even_light: true }
    }
}

impl TextureSettings {
    /// The sizes that a texture may have.
    pub const SIZES: [u32; 4] = [1024, 2048, 4096, 8192];

    /// Checks the ranges.
    ///
    /// # Errors
    /// [`TextureError::Settings`] names the first field that is out of range.
    pub fn check(&self) -> Result<(), TextureError> {
        let wrong = |text: String| Err(TextureError::Settings(text));
        if !Self::SIZES.contains(&self.size) {
            return wrong(format!("`size` is {}; it must be 1024, 2048, 4096 or 8192 (0 makes no texture)", self.size));
        }
        if !(1..=64).contains(&self.padding) {
            return wrong(format!("`padding` is {}; it must be from 1 to 64 texels", self.padding));
        }
        if !(1..=16).contains(&self.blended) || self.photos == 0 {
            return wrong("`blended` must be from 1 to 16, and `photos` at least 1".into());
        }
        Ok(())
    }

    /// Padding at this size, texels.
    pub(crate) fn texels_around(&self) -> u32 {
        (self.padding * self.size / 4096).max(1)
    }
}
