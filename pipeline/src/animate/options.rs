//! How layers are to move.

use std::{path::PathBuf, time::Duration};

use serde::Serialize;
use toile_animation::blend::Blend;
use toile_character::Skinning;

use crate::options::MotionChoice;

/// How much time a frame may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Profile {
    /// As much as it needs: cloth as it moves, layers moved apart at full resolution.
    #[default]
    Bake,
    /// No more than a screen leaves: three classes of cloth, layers kept in their order.
    Realtime,
}

/// How layers are to move.
#[derive(Debug, Clone)]
pub struct AnimateOptions {
    /// The motion.
    pub motion: MotionChoice,
    /// Frames a second.
    pub fps: f64,
    /// How much time a frame may take.
    pub profile: Profile,
    /// How the layers follow the skeleton in the profile `bake`.
    pub blend: Blend,
    /// How skin weights are blended.
    pub skinning: Skinning,
    /// Whether the motion is also made by each of the other blends, for pictures and times side by side.
    pub compare: bool,
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
            profile: Profile::default(),
            blend: Blend::default(),
            skinning: Skinning::Linear,
            compare: false,
            fabrics: None,
            settings: None,
            checkpoint_every: Duration::from_secs(2),
        }
    }
}
