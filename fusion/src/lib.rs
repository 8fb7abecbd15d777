//! Depth frames to a scan: filtering, tracking, loop closing, TSDF, surface extraction, clean-up.
//!
//! The way of a take:
//!
//! 1. `frame` drops depth edges and gives each pixel its normal; `subject` finds the person and cuts everything else away;
//! 2. `tracking` registers each frame to the model so far from a pose that the motion predicts, with colours where the
//!    shape leaves a direction open; trusted frames are fused into the `field`; a lost subject is searched for about the
//!    axis and must be confirmed by the next frame;
//! 3. `finish` optimises all poses together over overlapping frame pairs, so that the turn closes, fuses the frames again,
//!    registers them to the whole model, and makes the extracted mesh one closed, smooth, light surface.
//!
//! [`fuse`] runs all of it over a source; [`Fuser`] takes frames one by one, and [`finish`] makes their scan;
//! [`LiveFuser`] only follows, in little memory. Frames: `model_from_camera` while a take runs (the model's frame is
//! level, its origin on the turntable's axis, where a subject was found), `scan_from_camera` in the finished scan.

mod drop_reason;
mod error;
mod field;
mod finish;
mod frame;
mod report;
mod rig;
mod scan;
mod settings;
mod standing;
mod subject;
mod take;
mod timings;
mod tracking;

#[cfg(test)]
mod hard_cases;
#[cfg(test)]
mod test_scene;
#[cfg(test)]
mod tests;

pub use drop_reason::DropReason;
pub use error::FusionError;
pub use finish::finish;
pub use report::{DroppedFrame, FusionReport, MovedReport, SensorReport, VolumeReport};
pub use scan::{Scan, TrackedFrame};
pub use settings::{FusionSettings, KnownPose, Prior, Volume};
pub use subject::{ImageSide, SubjectVolume};
pub use take::{Fuser, LiveFuser, Outcome, fuse, survey};
pub use timings::{StepTiming, Timings};
pub use tracking::Tracked;

/// The steps of a frame one by one, for benchmarks and experiments.
pub mod steps {
    pub use crate::field::{Tsdf, extract_surface, integrate, ray_cast};
    pub use crate::frame::{CutDepth, DepthView, Rectifier, drop_edges, surface_elements};
    pub use crate::tracking::track;
}
