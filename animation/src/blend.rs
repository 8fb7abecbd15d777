//! Layers that move: skinning for what lies close, cloth for what hangs, and layers that stay apart.
//!
//! An [`Outfit`] is a body and its garments in the pose of scan 0. For each pose of a motion, in the order of the modules:
//!
//! 1. all layers follow the skeleton by their skin weights ([`toile_character::Skinner`]);
//! 2. where parts of the body come so near to each other that the cloth between them has no room, the layers on either
//!    side are pressed together in their order, and the body gives way where even that is not enough (`squeeze`);
//! 3. a proxy of each garment is simulated, tied to the skinned place by springs that are the stiffer the closer the
//!    cloth lies to the body (`anchors`, `proxy`), and the scanned mesh rides on it (`ride`);
//!
//! Before all of that, [`Clothed::make_room`] holds the arms of the motion as far from the body as the clothes between them need.
//!
//! [`Blend::Skinning`] ends after the first step. [`Blend::Physics`] and [`Blend::Seed`] leave out the second, simulate sheets that hang
//! by themselves (`hung`), and take all of their motion, or the share of it that the seed's eq. 9 gives (`shares`). Whoever keeps the layers apart at full resolution afterwards tells the wearer
//! where they came to lie ([`Wearer::correct`]): the next frame starts from there.

pub(crate) mod anchors;
mod hung;
pub(crate) mod layer;
pub(crate) mod loft;
pub(crate) mod outfit;
pub(crate) mod proxy;
pub(crate) mod ride;
mod room;
mod shares;
pub(crate) mod squeeze;
mod state;
pub(crate) mod strain;
mod wearer;

pub(crate) use anchors::{Closeness, frequency};
pub use layer::OutfitLayer;
pub use outfit::Outfit;
pub use room::{Clothed, Room};
pub(crate) use wearer::DRAG;
pub use wearer::Wearer;

use serde::{Deserialize, Serialize};

/// How the layers follow the skeleton.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Blend {
    /// By skin weights alone.
    Skinning,
    /// Cloth under its own weight, held by nothing but contact with the body, friction, and waistbands.
    Physics,
    /// Skinning and physics mixed by one weight a garment, two for a skirt (Hu et al. 2017, eq. 8 and 9).
    Seed,
    /// Cloth that is held where it lies on the body, and moves freely elsewhere.
    #[default]
    Anchored,
}

impl Blend {
    /// All of them, from the simplest on.
    pub const ALL: [Self; 4] = [Self::Skinning, Self::Physics, Self::Seed, Self::Anchored];

    /// Its name in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Skinning => "skinning",
            Self::Physics => "physics",
            Self::Seed => "seed",
            Self::Anchored => "anchored",
        }
    }

    /// True where sheets hang by themselves, tied to nothing but waistbands.
    fn hangs(self) -> bool {
        matches!(self, Self::Physics | Self::Seed)
    }
}
