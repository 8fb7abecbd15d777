//! Meshes, camera models, rigid transforms, nearest-point and ray queries, mesh clean-up, PLY and OBJ files.
//!
//! Everything that more than one stage needs and that knows neither bodies, garments nor devices:
//!
//! - [`Mesh`]: an indexed triangle mesh with optional normals, colours and named vertex attributes;
//! - [`camera::PinholeCamera`]: pinhole projection with optional Brown–Conrady distortion;
//! - [`bvh::Bvh`]: closest point, ray and overlap queries over a mesh's triangles;
//! - [`raster::rasterize`]: the triangles that a camera sees;
//! - [`topology`]: edges, neighbours, boundary loops, components; [`areas`], [`laplacian`], [`edge_distance`],
//!   [`surface_solve`]: measures and equations on a surface; [`section`]: what a plane cuts;
//! - [`statistics`]: medians, quantiles, robust spreads; [`lanes`]: vector instructions chosen at run time;
//! - [`ply`], [`obj`]: files.
//!
//! Conventions: metres, right-handed. Subject frame: +Y up, +Z the front, origin on the floor. Camera frame:
//! +X right, +Y down, +Z forward, pixel centres at integers. `a_from_b` maps coordinates in frame b to frame a.
//!
//! ```
//! use toile_geometry::{Mesh, bvh::Bvh};
//! use nalgebra::{Point3, Vector3};
//! let mesh = Mesh::new(
//!     vec![Point3::new(0.0, 0.0, 0.0), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)],
//!     vec![[0, 1, 2]],
//! );
//! let bvh = Bvh::new(&mesh.positions, &mesh.triangles);
//! let hit = bvh.closest(&Point3::new(0.2, 0.2, 0.5), f32::INFINITY).expect("the mesh has a triangle");
//! assert!((hit.distance - 0.5).abs() < 1e-6);
//! ```

pub mod areas;
pub mod bvh;
pub mod camera;
pub mod color_transfer;
pub mod components;
pub mod decimate;
pub mod direction;
pub mod edge_distance;
pub mod element;
mod error;
pub mod file;
pub mod handles;
pub mod holes;
pub mod hull;
pub mod intersection;
pub mod lanes;
pub mod laplacian;
pub mod max_flow;
pub mod mesh;
pub mod obj;
pub mod open_surface;
pub mod ply;
pub mod point_tree;
pub mod polygon;
pub mod predicates;
pub mod raster;
pub mod remesh;
pub mod rims;
pub mod section;
pub mod smooth;
pub mod statistics;
pub mod surface_solve;
pub mod topology;
pub mod triangle;
pub mod volume;

pub use error::GeometryError;
pub use mesh::Mesh;

/// A rigid transform in f64; name values `a_from_b`.
pub type Rigid = nalgebra::Isometry3<f64>;

/// Maps an f32 point through an f64 rigid transform: the one place where bulk points meet poses.
#[inline]
pub fn transform_point(a_from_b: &Rigid, point_b: &nalgebra::Point3<f32>) -> nalgebra::Point3<f32> {
    (a_from_b * point_b.cast::<f64>()).cast::<f32>()
}
