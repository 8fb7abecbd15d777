//! The size of textures on the command line.

/// Largest edge of a texture.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
pub enum TextureSize {
    /// 1024 texels
    #[value(name = "1024")]
    T1024,
    /// 2048 texels
    #[value(name = "2048")]
    T2048,
    /// 4096 texels
    #[value(name = "4096")]
    T4096,
    /// 8192 texels
    #[value(name = "8192")]
    T8192,
    /// No texture
    Off,
}

impl From<TextureSize> for u32 {
    fn from(size: TextureSize) -> Self {
        match size {
            TextureSize::T1024 => 1024,
            TextureSize::T2048 => 2048,
            TextureSize::T4096 => 4096,
            TextureSize::T8192 => 8192,
            TextureSize::Off => 0,
        }
    }
}
