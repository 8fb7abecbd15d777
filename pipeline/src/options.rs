//! What may be chosen for a run.

use std::path::PathBuf;

use toile_character::JointNaming;
use toile_fusion::FusionSettings;
use toile_garments::CullSettings;

use crate::{PipelineError, motion};

/// How far to go.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Goal {
    /// A scan of each take.
    Scans,
    /// The body of the first scan.
    Body,
    /// The garments in the common frame.
    Garments,
    /// The avatar's files.
    Avatar,
    /// The page for the operator.
    Report,
}

/// What may be chosen for a whole run.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// BVH motion for the avatar; without, the shipped walk.
    pub motion: Option<PathBuf>,
    /// How takes are fused.
    pub fusion: FusionSettings,
    /// What the joints are called in `avatar.glb`.
    pub joint_names: JointNaming,
    /// Stop after this layer; without, all of them.
    pub last_layer: Option<String>,
    /// Leave out of the avatar what clothes hide; without, it is whole.
    pub cull: Option<CullSettings>,
}

impl Options {
    /// Checks what would fail only after a long time.
    ///
    /// # Errors
    /// [`PipelineError`] where the motion cannot be used.
    pub fn check(&self) -> Result<(), PipelineError> {
        self.motion.as_deref().map_or(Ok(()), motion::check)
    }
}
