//! The generic garments: one a type of dress, and the lines that each is cut at.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};
use toile_character::GarmentType;

/// A generic garment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[allow(missing_docs)] // the names are the documentation
pub enum GenericGarment {
    TShirt,
    Shirt,
    Jumper,
    Jacket,
    Coat,
    Trousers,
    Shorts,
    Skirt,
}

/// How a generic garment is cut out of the body's surface; lengths are shares of the mean body's own, so that they hold for any body.
pub(super) struct Pattern {
    /// Distance from the skin, metres: half of the ease that tailors add to the chest or hip girth, over π.
    pub ease: f32,
    /// Where sleeves end between shoulder (0) and wrist (1); without, it has no upper part.
    pub sleeve: Option<f32>,
    /// Where legs end between hip joint (0) and ankle (1); without, it has no legs.
    pub leg: Option<f32>,
    /// Where it ends below the hip joints, as a share of the way to the ankles, where it has no legs.
    pub hem: f32,
    /// How much wider each metre below the hips gets, metres.
    pub flare: f32,
    /// Open in front.
    pub open: bool,
}

impl GenericGarment {
    /// All of them.
    pub const ALL: [Self; 8] =
        [Self::TShirt, Self::Shirt, Self::Jumper, Self::Jacket, Self::Coat, Self::Trousers, Self::Shorts, Self::Skirt];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::TShirt => "t-shirt",
            Self::Shirt => "shirt",
            Self::Jumper => "jumper",
            Self::Jacket => "jacket",
            Self::Coat => "coat",
            Self::Trousers => "trousers",
            Self::Shorts => "shorts",
            Self::Skirt => "skirt",
        }
    }

    /// The type of garment that it is.
    pub fn garment_type(self) -> GarmentType {
        match self {
            Self::TShirt | Self::Shirt | Self::Jumper => GarmentType::Top,
            Self::Jacket | Self::Coat => GarmentType::Jacket,
            Self::Trousers | Self::Shorts => GarmentType::Trousers,
            Self::Skirt => GarmentType::Skirt,
        }
    }

    /// Those that a garment of this type may be: of one cut only, since conforming changes ease and lengths. Empty for types that
    /// have none.
    pub fn of_type(garment_type: GarmentType) -> &'static [Self] {
        match garment_type {
            GarmentType::Top => &[Self::TShirt, Self::Shirt],
            GarmentType::Jacket => &[Self::Jacket, Self::Jumper, Self::Coat],
            GarmentType::Trousers => &[Self::Trousers, Self::Shorts],
            GarmentType::Skirt => &[Self::Skirt],
            _ => &[],
        }
    }

    /// How it is cut: an ease of 8 cm of girth in a T-shirt, 10 in a shirt, 14 in a jumper, 18 in a jacket, 24 in a coat, 6 in
    /// trousers and skirts, as books of pattern cutting give for a fit that is not tight.
    pub(super) fn pattern(self) -> Pattern {
        let girth = |ease: f32| ease / std::f32::consts::TAU;
        let top = |ease, sleeve, hem| Pattern {
            ease: girth(ease),
            sleeve: Some(sleeve),
            leg: None,
            hem,
            flare: 0.0,
            open: false,
        };
        let bottom = |leg, hem, flare| Pattern { ease: girth(0.06), sleeve: None, leg, hem, flare, open: false };
        match self {
            Self::TShirt => top(0.08, 0.40, 0.10),
            Self::Shirt => top(0.10, 0.97, 0.14),
            Self::Jumper => top(0.14, 0.97, 0.10),
            Self::Jacket => Pattern { open: true, ..top(0.18, 0.97, 0.15) },
            Self::Coat => Pattern { open: true, flare: 0.1, ..top(0.24, 0.97, 0.55) },
            Self::Trousers => bottom(Some(0.97), 0.0, 0.0),
            Self::Shorts => bottom(Some(0.40), 0.0, 0.0),
            Self::Skirt => bottom(None, 0.45, 0.15),
        }
    }
}

impl fmt::Display for GenericGarment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for GenericGarment {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|kind| kind.name() == text).ok_or_else(|| {
            let names: Vec<_> = Self::ALL.iter().map(|kind| kind.name()).collect();
            format!("`{text}` is not a generic garment; there are {}", names.join(", "))
        })
    }
}
