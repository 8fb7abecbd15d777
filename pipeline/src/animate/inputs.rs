//! What a motion is written from.

use std::path::Path;

use toile_avatar::Avatar;
use toile_character::Motion;
use toile_cloth::Fabric;

use super::options::AnimateOptions;
use crate::{Observer, garment::Garment};

/// A motion that is to be written.
pub(super) struct Baking<'a> {
    pub avatar: &'a Avatar,
    pub garments: &'a [Garment],
    /// What each layer is made of.
    pub fabrics: &'a [Fabric],
    pub motion: &'a Motion,
    pub options: &'a AnimateOptions,
    pub folder: &'a Path,
    pub observer: &'a dyn Observer,
}
