//! The formats that an avatar is written in.

use serde::{Deserialize, Serialize};

/// A format of the avatar's files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FileFormat {
    /// `avatar.glb`: always written, the page and other steps need it.
    Glb,
    /// `avatar.vrm`: always written.
    Vrm,
    /// `avatar.obj` and `avatar.mtl`: the layers in scan 0's pose.
    Obj,
    /// `avatar-LAYER.ply`: the same, a file a layer, with skin weights.
    Ply,
    /// `avatar.bvh`: the motion on the avatar's own skeleton.
    Bvh,
    /// `avatar.usda`: layers, skeleton and motion.
    Usda,
}

impl FileFormat {
    /// Those of `asked` that are not written anyway, in order, each once.
    pub fn beside_usual(asked: &[Self]) -> Vec<Self> {
        let mut formats: Vec<Self> = asked.iter().copied().filter(|f| !matches!(f, Self::Glb | Self::Vrm)).collect();
        formats.sort_unstable();
        formats.dedup();
        formats
    }

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Glb => "glb",
            Self::Vrm => "vrm",
            Self::Obj => "obj",
            Self::Ply => "ply",
            Self::Bvh => "bvh",
            Self::Usda => "usda",
        }
    }
}
