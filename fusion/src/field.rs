//! The signed distance field: views go in, rays and surfaces come out.

mod band;
mod block;
mod block_index;
mod cube_table;
mod integrate;
mod layers;
mod pixels;
mod projection;
mod raycast;
mod surface;
mod tsdf;

pub(crate) use block::VOXELS;
pub(crate) use layers::Touched;
pub(crate) use raycast::{Hit, ModelView};
pub(crate) use surface::{WEIGHT, crossings, tidy};

pub use integrate::integrate;
pub use raycast::ray_cast;
pub use surface::extract_surface;
pub use tsdf::Tsdf;
