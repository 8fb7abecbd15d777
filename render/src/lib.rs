//! One small CPU rasteriser for reports, sensors and tests.
//!
//! - [`rasterize`] (from the geometry crate): meshes seen by a pinhole camera;
//! - [`shade`]: hemisphere and key light on sRGB albedo;
//! - [`picture::picture`]: meshes fitted into a [`View`], coloured by their vertices, plain, as clay or by an attribute;
//! - [`sheet::contact_sheet`], [`sheet::scale_bar`], [`label::draw`]: pictures side by side, legends, small text;
//! - [`png::encode`], [`film::gif`]: the bytes of a PNG file, of a moving picture.
//!
//! World: any right-handed frame with +Y up. Camera: +X right, +Y down, +Z forward, pixel centres at integers.
//! Everything gives the same bytes for any number of threads.
//!
//! ```
//! use toile_geometry::Mesh;
//! use toile_render::{Drawn, View, picture, png};
//! use nalgebra::Point3;
//! let mesh = Mesh::new(
//!     vec![Point3::new(-1.0, 0.0, 0.0), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)],
//!     vec![[0, 1, 2]],
//! );
//! let image = picture::picture(&[Drawn::clay(&mesh)], &View::front(), 64, 48).expect("the mesh is valid");
//! let centre = image.get_pixel(32, 24);
//! assert_ne!(centre, image.get_pixel(0, 0));
//! assert!(png::encode(&image).expect("an image in memory encodes").starts_with(b"\x89PNG"));
//! ```

pub mod colormap;
mod error;
pub mod film;
mod font;
pub mod label;
pub mod picture;
pub mod png;
pub mod shade;
pub mod sheet;
pub mod view;

pub use error::RenderError;
pub use image::RgbImage;
pub use picture::{Drawn, Paint, picture};
pub use toile_geometry::raster::{Camera, NOTHING, Raster, rasterize};
pub use view::View;
