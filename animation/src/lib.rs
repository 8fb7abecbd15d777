//! Motion: BVH files, retargeting onto a person's skeleton.
//!
//! - [`bvh`]: motion files read and written;
//! - [`retarget`]: any of the usual skeletons carried onto the target's 52 joints;
//! - [`walk`]: a walk of our own making, also in `assets/walk.bvh` ([`shipped_walk`]);
//! - [`blend`]: the layers of an outfit in motion, by skinning and by cloth;
//! - [`realtime`]: the same frame by frame as a live object, fast enough for a screen;
//! - [`decomposition`]: helper joints and weights by which skinning follows layers that move by themselves;
//! - [`foot_figures`]: how well the feet of a motion stand, measured on the body's surface;
//! - [`springs`]: chains of joints on which loose parts swing in other programs;
//! - [`resample`], [`close_loop`], [`turn_of_loop`]: other rates, endless motions.
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

pub mod blend;
pub mod bvh;
pub mod decomposition;
mod error;
mod foot_figures;
mod footing;
pub mod realtime;
mod retarget;
mod skeleton;
pub mod springs;
mod walk;

pub use bvh::Bvh;
pub use error::AnimationError;
pub use foot_figures::{FootFigures, foot_figures};
pub use footing::Footing;
pub use retarget::{
    RetargetReport, RetargetSettings, Retargeted, close_loop, resample, retarget, retarget_body, turn_of_loop,
};
pub use walk::{SHIPPED_WALK, WalkSettings, shipped_walk, walk};
