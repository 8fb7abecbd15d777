//! The settings of all stages, and the file that changes them: `toile.toml`.
//!
//! Every field has a default, so that no file is needed. A subject's own file lies in its folder; another one can be
//! given for a run and wins over it, field by field. Every step writes its resolved settings into its record.

mod fields;
mod print;
mod read;

use serde::{Deserialize, Serialize};
use toile_animation::RetargetSettings;
use toile_fitting::{FitSettings, UnderSettings};
use toile_fusion::FusionSettings;
use toile_garments::{ExtractSettings, StackSettings};
use toile_texture::TextureSettings;

use crate::options::Springs;
pub use print::print;
pub use read::{FILE_NAME, read};

/// The settings of all stages: a table of the file each.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// How takes are fused.
    pub fusion: FusionSettings,
    /// How textures are made.
    pub texture: TextureSettings,
    /// How the body is fitted to the undressed scan.
    pub fit: FitSettings,
    /// How the body is posed inside a dressed scan.
    pub under_clothes: UnderSettings,
    /// How a garment is found in a scan and cut out.
    pub extract: ExtractSettings,
    /// How layers are pushed apart.
    pub stack: StackSettings,
    /// How a motion is carried over.
    pub motion: RetargetSettings,
    /// How the avatar's files are made.
    pub avatar: AvatarSettings,
}

/// How the avatar's files are made.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AvatarSettings {
    /// Whether loose parts of garments swing in `avatar.vrm`. Default on.
    pub springs: Springs,
}
