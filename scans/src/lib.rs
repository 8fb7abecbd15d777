//! Finished scans of other programs: from a mesh file to a scan as fusion gives one.
//!
//! 1. [`read`]: a PLY, OBJ, glTF or STL file with its textures, as a [`Surface`] in the file's own units and axes;
//! 2. [`Unit::find`] and [`Up`]: how long one of its units is, and which of its axes points up;
//! 3. [`clean`]: one closed, light, coloured [`Mesh`](toile_geometry::Mesh) in metres, +Y up, on the floor.
//!
//! What had to be guessed or repaired is told in sentences ([`Surface::notices`], [`Cleaned`]).
//!
//! ```
//! use toile_scans::{Surface, Unit};
//! let stl = b"solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 100 0 0\nvertex 0 175 0\nendloop\nendfacet\n";
//! let surface: Surface = toile_scans::decode_stl(stl)?;
//! assert_eq!(Unit::find(&surface)?, Unit::Centimetre);
//! # Ok::<(), String>(())
//! ```

mod axes;
mod clean;
mod files;
mod repair;
mod surface;
mod unit;

pub use axes::Up;
pub use clean::{CleanSettings, Cleaned, clean};
pub use files::{Kind, decode_glb, decode_obj, decode_ply, decode_stl, kind_of, others, read, unreadable};
pub use surface::{Material, Surface};
pub use unit::Unit;
