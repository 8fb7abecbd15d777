//! Facts about each type of garment: where on the body it can be (Hu et al. 2017, §6.2 and Fig. 6), and its cloth.

use toile_character::GarmentType;

use crate::measure::body_parts::{BodyPart, PART_COUNT};

/// Log odds that a point of each body part (by [`BodyPart`] index) belongs to a garment of a type, before anything was
/// measured. Natural logarithm; 0 says nothing.
pub fn log_odds(garment_type: GarmentType) -> [f32; PART_COUNT] {
    // head, neck, torso, pelvis, upper arm, lower arm, hand, upper leg, lower leg, foot
    match garment_type {
        GarmentType::Top => [-3.0, -0.5, 0.7, 0.2, 0.2, -0.1, -3.0, -1.0, -3.0, -3.0],
        GarmentType::Trousers => [-4.0, -4.0, -2.0, 0.5, -4.0, -4.0, -4.0, 0.7, 0.2, -1.5],
        GarmentType::Skirt => [-4.0, -4.0, -1.5, 0.7, -4.0, -4.0, -4.0, 0.5, 0.0, -2.0],
        GarmentType::Dress => [-4.0, -0.5, 0.7, 0.7, 0.0, -0.1, -3.0, 0.5, 0.0, -2.0],
        GarmentType::Jacket => [-2.0, -0.3, 0.3, 0.1, 0.5, 0.3, -2.0, -0.3, -1.0, -3.0],
        GarmentType::Hat => [0.7, -1.0, -3.0, -4.0, -4.0, -4.0, -4.0, -4.0, -4.0, -4.0],
        GarmentType::Shoes => [-4.0, -4.0, -4.0, -4.0, -4.0, -4.0, -4.0, -3.0, -0.3, 0.7],
        GarmentType::Other => [0.0; PART_COUNT],
    }
}

/// The rough segmentation of the body for a garment type, as the seed prepares one for each: the parts that such a
/// garment covers. `None` for [`GarmentType::Other`], which can be anywhere.
pub fn covered_parts(garment_type: GarmentType) -> Option<&'static [BodyPart]> {
    use BodyPart as P;
    match garment_type {
        GarmentType::Top => Some(&[P::Torso, P::Pelvis, P::UpperArm]),
        GarmentType::Trousers => Some(&[P::Pelvis, P::UpperLeg, P::LowerLeg]),
        GarmentType::Skirt => Some(&[P::Pelvis, P::UpperLeg]),
        GarmentType::Dress => Some(&[P::Torso, P::Pelvis, P::UpperLeg]),
        GarmentType::Jacket => Some(&[P::Torso, P::Pelvis, P::UpperArm, P::LowerArm]),
        GarmentType::Hat => Some(&[P::Head]),
        GarmentType::Shoes => Some(&[P::Foot]),
        GarmentType::Other => None,
    }
}

/// How thick the cloth of a type of garment commonly is, metres: shirting and knits up to 1 mm, a lined jacket, a scarf, a
/// felt hat or shoe leather about 2 mm. Scans do not show it: the noise of sensors is as large.
pub fn cloth_thickness(garment_type: GarmentType) -> f32 {
    match garment_type {
        GarmentType::Top | GarmentType::Trousers | GarmentType::Skirt | GarmentType::Dress => 0.001,
        GarmentType::Jacket | GarmentType::Hat | GarmentType::Shoes | GarmentType::Other => 0.002,
    }
}
