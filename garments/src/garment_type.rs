//! Types of garment and where on the body each can be (the seed's templates, Hu et al. 2017, §6.2 and Fig. 6).

use serde::{Deserialize, Serialize};

use crate::{
    body_parts::{BodyPart, PART_COUNT},
    guess::LEGS_APART,
};

/// What kind of garment a layer is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum GarmentType {
    /// Covers the torso, closed all round: shirt, blouse, jumper.
    Top,
    /// Covers the pelvis and each leg by itself.
    Trousers,
    /// Hangs from the waist around both legs.
    Skirt,
    /// Torso and legs in one.
    Dress,
    /// A jacket or coat, mostly open in front.
    Jacket,
    /// Anything else: scarf, hat, shoes, gloves.
    Other,
}

impl GarmentType {
    /// Log odds that a point of each body part (by [`BodyPart`] index) belongs to a garment of this type, before
    /// anything was measured. Natural logarithm; 0 says nothing.
    pub fn prior(self) -> [f32; PART_COUNT] {
        // head, neck, torso, pelvis, upper arm, lower arm, hand, upper leg, lower leg, foot
        match self {
            Self::Top => [-3.0, -0.5, 0.7, 0.2, 0.2, -0.1, -3.0, -1.0, -3.0, -3.0],
            Self::Trousers => [-4.0, -4.0, -2.0, 0.5, -4.0, -4.0, -4.0, 0.7, 0.2, -1.5],
            Self::Skirt => [-4.0, -4.0, -1.5, 0.7, -4.0, -4.0, -4.0, 0.5, 0.0, -2.0],
            Self::Dress => [-4.0, -0.5, 0.7, 0.7, 0.0, -0.1, -3.0, 0.5, 0.0, -2.0],
            Self::Jacket => [-2.0, -0.3, 0.3, 0.1, 0.5, 0.3, -2.0, -0.3, -1.0, -3.0],
            Self::Other => [0.0; PART_COUNT],
        }
    }

    /// How thick the cloth of such a garment commonly is, metres, where nobody told: shirting and knits up to 1 mm,
    /// a lined jacket or a scarf about 2 mm. Sensors do not tell: their noise is as large.
    pub fn thickness(self) -> f32 {
        match self {
            Self::Top | Self::Trousers | Self::Skirt | Self::Dress => 0.001,
            Self::Jacket | Self::Other => 0.002,
        }
    }

    /// The type that fits a garment best, from the share of each body part's area that it covers, the share of the
    /// inner thighs that it follows, and whether it is open in front.
    pub fn guess(covered: &[f32; PART_COUNT], inner_thighs: f32, open_in_front: bool) -> Self {
        let c = |part: BodyPart| covered[part as usize];
        let torso = c(BodyPart::Torso);
        let legs = c(BodyPart::UpperLeg);
        let pelvis = c(BodyPart::Pelvis);
        match () {
            () if torso > 0.35 && open_in_front => Self::Jacket,
            () if torso > 0.35 && legs > 0.4 => Self::Dress,
            () if torso > 0.35 => Self::Top,
            () if pelvis > 0.3 && inner_thighs > LEGS_APART => Self::Trousers,
            () if pelvis > 0.3 => Self::Skirt,
            () => Self::Other,
        }
    }
}

impl std::str::FromStr for GarmentType {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Ok(match name.trim().to_lowercase().as_str() {
            "top" | "shirt" | "tshirt" | "t-shirt" | "blouse" | "jumper" => Self::Top,
            "trousers" | "shorts" => Self::Trousers,
            "skirt" => Self::Skirt,
            "dress" => Self::Dress,
            "jacket" | "coat" => Self::Jacket,
            "other" | "scarf" | "hat" => Self::Other,
            _ => return Err(format!("{name} is no garment type: top, trousers, skirt, dress, jacket or other")),
        })
    }
}

impl std::fmt::Display for GarmentType {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Top => "top",
            Self::Trousers => "trousers",
            Self::Skirt => "skirt",
            Self::Dress => "dress",
            Self::Jacket => "jacket",
            Self::Other => "other",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back_and_wrong_ones_refused() {
        use GarmentType::*;
        for t in [Top, Trousers, Skirt, Dress, Jacket, Other] {
            assert_eq!(t.to_string().parse(), Ok(t));
        }
        assert!("trouser press".parse::<GarmentType>().is_err());
    }

    #[test]
    fn guesses_follow_coverage() {
        let covered = |pairs: &[(BodyPart, f32)]| {
            let mut c = [0.0; PART_COUNT];
            pairs.iter().for_each(|&(p, x)| c[p as usize] = x);
            c
        };
        use BodyPart::*;
        let legs = covered(&[(Pelvis, 0.8), (UpperLeg, 1.0), (LowerLeg, 0.9)]);
        assert_eq!(GarmentType::guess(&legs, 0.9, false), GarmentType::Trousers);
        assert_eq!(GarmentType::guess(&legs, 0.02, false), GarmentType::Skirt);
        let torso = covered(&[(Torso, 0.9), (UpperArm, 0.6)]);
        assert_eq!(GarmentType::guess(&torso, 0.0, false), GarmentType::Top);
        assert_eq!(GarmentType::guess(&torso, 0.0, true), GarmentType::Jacket);
        assert_eq!(GarmentType::guess(&covered(&[(Head, 0.5)]), 0.0, false), GarmentType::Other);
    }
}
