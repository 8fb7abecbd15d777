//! The options of a run.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use toile_character::JointNaming;
use toile_fusion::FusionSettings;
use toile_garments::{CullSettings, Part};

use crate::{PipelineError, formats::FileFormat, motion};

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

/// The options of a whole run.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// How the avatar moves.
    pub motion: MotionChoice,
    /// The names of the joints in `avatar.glb`; without, as before.
    pub joint_names: Option<JointNaming>,
    /// The hidden triangles that the avatar leaves out.
    pub hidden: HiddenChoice,
    /// Whether loose parts swing in `avatar.vrm`; without, as before.
    pub springs: Option<Springs>,
    /// Whether generic garments stand for those that were cut; without, as before.
    pub generic: Option<bool>,
    /// What gives way where a garment is too tight for the body; without, as before.
    pub part: Option<Part>,
    /// The formats that the avatar is written in beside GLB and VRM; without, as before.
    pub formats: Option<Vec<FileFormat>>,
    /// The levels of detail that the avatar is also written in, triangles a layer; without, as before.
    pub levels: Option<Vec<usize>>,
    /// Stop after this layer; without, all of them.
    pub last_layer: Option<String>,
    /// A file of settings beside the subject's own `toile.toml`.
    pub settings: Option<PathBuf>,
    /// Largest edge of a texture for this run, texels; 0 makes none.
    pub texture: Option<u32>,
    /// Settings of the fusion that were chosen for this run alone.
    pub fusion: FusionChoice,
    /// The first take shows the person dressed; it is kept in `edits/body.json`.
    pub dressed: bool,
}

/// How the avatar moves.
#[derive(Debug, Clone, Default, PartialEq)]
pub enum MotionChoice {
    /// As when it was made last; the shipped walk the first time.
    #[default]
    AsBefore,
    /// The shipped walk.
    Walk,
    /// A BVH file.
    File(PathBuf),
}

/// The hidden triangles that the avatar leaves out.
#[derive(Debug, Clone, Default, PartialEq)]
pub enum HiddenChoice {
    /// As when it was made last; nothing the first time.
    #[default]
    AsBefore,
    /// Nothing: every layer is whole.
    Whole,
    /// The triangles that no one can see.
    LeftOut(CullSettings),
}

/// Whether loose parts of garments swing on springs in `avatar.vrm`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Springs {
    /// Where something hangs loose.
    #[default]
    On,
    /// Never: everything follows the skeleton.
    Off,
}

/// Changes the settings of the fusion.
#[derive(Debug, Clone, Default)]
pub struct FusionChoice {
    /// The frames that are fused.
    pub volume: Option<toile_fusion::Volume>,
    /// The assumption about the motion.
    pub prior: Option<toile_fusion::Prior>,
    /// Edge of a voxel, metres.
    pub voxel_size: Option<f64>,
    /// Truncation distance, metres; without, it scales with the voxels.
    pub truncation: Option<f64>,
    /// Known poses.
    pub poses: Option<Vec<toile_fusion::KnownPose>>,
}

impl Options {
    /// Checks what would fail only after a long time.
    ///
    /// # Errors
    /// [`PipelineError`] where the motion cannot be used.
    pub fn check(&self) -> Result<(), PipelineError> {
        match &self.motion {
            MotionChoice::File(path) => motion::check(path),
            MotionChoice::AsBefore | MotionChoice::Walk => Ok(()),
        }
    }
}

impl FusionChoice {
    /// The settings with what was chosen.
    pub fn over(&self, settings: &FusionSettings) -> FusionSettings {
        let mut chosen = settings.clone();
        chosen.volume = self.volume.unwrap_or(settings.volume);
        chosen.prior = self.prior.unwrap_or(settings.prior);
        if let Some(voxel_size) = self.voxel_size {
            chosen.truncation *= voxel_size / settings.voxel_size;
            chosen.voxel_size = voxel_size;
        }
        chosen.truncation = self.truncation.unwrap_or(chosen.truncation);
        chosen.poses = self.poses.clone().or(chosen.poses);
        chosen
    }
}
