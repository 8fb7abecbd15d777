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
mod report;
mod settings;
mod sight;
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
pub use error::TextureError;
pub use photo::Photo;
pub use report::TextureReport;
pub use settings::TextureSettings;
pub use size::fitting_size;
pub use unwrap::{unwrap, unwrap_from};
