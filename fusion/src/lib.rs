//! Depth frames to a scan: filtering, tracking, loop closing, TSDF, surface extraction, clean-up.
//!
//! The way of a take:
//!
//! 1. [`depth_filter`] drops depth edges; [`volume`] and [`floor`] find the subject and cut everything else away;
//! 2. [`track`] registers each frame to the model so far ([`tsdf`], [`raycast`]) from a pose that [`motion`]
//!    predicts, with colours where the shape leaves a direction open; trusted frames are fused ([`integrate`]); a lost
//!    subject is searched for about the axis and must be confirmed by the next frame;
//! 3. [`closing`] optimises all poses together over overlapping frame pairs, so that the turn closes;
//! 4. the frames are fused again and registered to the whole model;
//! 5. [`surface`] extracts the mesh, [`clean_up`] makes it one closed, smooth, light surface.
//!
//! [`fuse`] runs all of it over a source; [`Fuser`] takes frames one by one; [`LiveFuser`] only follows, in little memory.

mod band;
pub mod clean_up;
pub mod closing;
mod cube_table;
pub mod depth_filter;
pub mod error;
mod finish;
pub mod floor;
pub mod fuser;
pub mod integrate;
mod layers;
pub mod live;
pub mod motion;
pub mod noise;
pub mod normals;
mod photometric;
mod projection;
pub mod raycast;
mod relocalise;
pub mod report;
pub mod scan;
pub mod settings;
pub mod surface;
pub mod take;
pub mod track;
pub mod tsdf;
pub mod view;
pub mod volume;

#[cfg(test)]
mod hard_cases;
#[cfg(test)]
mod test_scene;
#[cfg(test)]
mod tests;

pub use toile_geometry::element;
use toile_geometry::lanes::floats as lanes;

pub use error::FusionError;
pub use fuser::{Fuser, Outcome};
pub use live::LiveFuser;
pub use report::{FusionReport, Timings};
pub use scan::{Scan, TrackedFrame};
pub use settings::{FusionSettings, KnownPose, Prior, Volume};
pub use take::{fuse, survey};
