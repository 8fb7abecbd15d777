//! From a depth image to surface elements: filtering, noise, normals and colours of one frame.

mod cut_depth;
mod depth_filter;
mod noise;
mod normals;
mod rectifier;
mod view;

pub(crate) use noise::depth_noise;
pub(crate) use normals::{PAGE, dot, window_for};
pub(crate) use view::{decode_color, is_measured, unproject};

pub use cut_depth::CutDepth;
pub use depth_filter::drop_edges;
pub use normals::surface_elements;
pub use rectifier::Rectifier;
pub use view::DepthView;
