//! Colour pictures to textures.
//!
//! The way of a layer:
//!
//! 1. [`unwrap`] lays the mesh flat in charts: the [`Atlas`];
//! 2. `photo` decodes the part of each picture that shows the surface, as splines in linear light; `sight` finds what each picture
//!    shows of every vertex, and how well;
//! 3. `light` solves for the room's light, the lens's fall-off and all exposures together; `level` gives each vertex its own colour, and
//!    each picture what brings it there; `views` chooses the pictures that detail comes from;
//! 4. [`bake`] gives each texel its colour; `pad` fills between charts.
//!
//! [`carry`] brings a texture from one surface to the atlas of another that lies on it.
//!
//! [`simplify`] makes levels of detail that stay in their places in the picture, [`relief`] the normal maps that give them what they lost.
//!
//! Nothing here moves geometry.

mod atlas;
mod bake;
mod carry;
mod charts;
mod encode;
mod error;
mod level;
mod light;
mod pack;
mod pad;
mod photo;
mod raster;
mod relief;
mod report;
mod settings;
mod sight;
mod simplify;
mod size;
mod spline;
#[cfg(test)]
mod tests;
mod unwrap;
mod views;
mod zonal;

pub use atlas::Atlas;
pub use bake::{Texture, bake};
pub use carry::{CarrySettings, Painted, carry};
pub use encode::{encode_png, encode_rgb_jpeg};
pub use error::TextureError;
pub use photo::Photo;
pub use relief::{Shape, relief};
pub use report::TextureReport;
pub use settings::TextureSettings;
pub use simplify::{Seamed, simplify};
pub use size::fitting_size;
pub use unwrap::{unwrap, unwrap_from};
