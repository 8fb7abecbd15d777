//! Motion: BVH files, retargeting onto a person's skeleton.
//!
//! - [`bvh`]: motion files read and written;
//! - [`retarget`](fn@retarget): any of the usual skeletons carried onto the target's 52 joints;
//! - [`mod@walk`]: a walk of our own making, also in `assets/walk.bvh` ([`shipped_walk`]);
//! - [`mod@resample`], [`close_loop`]: other rates, endless motions;
//!
//! ```
//! use toile_animation::{RetargetSettings, retarget, shipped_walk};
//! use toile_character::BodyModel;
//!
//! let model = BodyModel::load_default()?;
//! let person = model.skeleton_at(&vec![0.0; model.component_count()]);
//! let result = retarget(&shipped_walk()?, "walk", &person, &RetargetSettings::default())?;
//! assert_eq!(result.motion.poses.len(), 129);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Poses are relative to the A-pose rest of the person; +Y up, +Z the front; metres, radians, seconds.

pub mod bvh;
mod bvh_read;
pub mod error;
mod gait;
mod ground;
mod joint_names;
pub mod looping;
mod reference;
pub mod resample;
pub mod retarget;
mod source;
mod stance;
pub mod walk;

pub use bvh::Bvh;
pub use error::AnimationError;
pub use looping::close_loop;
pub use resample::resample;
pub use retarget::{RetargetReport, RetargetSettings, Retargeted, retarget};
pub use walk::{WalkSettings, shipped_walk, walk};
