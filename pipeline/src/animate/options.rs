//! How layers are to move.

use std::{path::PathBuf, time::Duration};

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
    /// A file of fabrics, and of which garment is made of what.
    pub fabrics: Option<PathBuf>,
    /// Settings of the stages.
    pub settings: Option<PathBuf>,
    /// How often it is written down where the run stands, at most: a killed run loses no more.
    pub checkpoint_every: Duration,
}

impl Default for AnimateOptions {
    fn default() -> Self {
        Self {
            motion: MotionChoice::AsBefore,
            fps: 30.0,
            blend: Blend::default(),
            skinning: Skinning::Linear,
            fabrics: None,
            settings: None,
            checkpoint_every: Duration::from_secs(2),
        }
    }
}
