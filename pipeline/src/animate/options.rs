//! How layers are to move.

use std::path::PathBuf;

use toile_animation::blend::Blend;
use toile_character::Skinning;

use crate::options::MotionChoice;

/// How layers are to move.
#[derive(Debug, Clone)]
pub struct AnimateOptions {
    /// The motion.
    pub motion: MotionChoice,
    /// Frames a second.
    pub fps: f64,
    /// How the layers follow the skeleton.
    pub blend: Blend,
    /// How skin weights are blended.
    pub skinning: Skinning,
    /// Settings of the stages.
    pub settings: Option<PathBuf>,
}
