//! Where on the person the pieces of skin meet: read off the template's landmarks.

use nalgebra::Point3;
use toile_character::{BodyModel, Joint};

use crate::{
    ImplicitError,
    bones::{Bones, Place},
};

/// Places at rest that the plan starts from.
#[derive(Debug, Clone, Copy)]
pub struct Marks {
    /// Armpits, left and right.
    pub armpits: [Point3<f64>; 2],
    /// The lowest point between the legs.
    pub crotch: Point3<f64>,
    /// Height of the person from soles to the top of the head, metres.
    pub height: f64,
}

impl Marks {
    /// On the body of `model` with coefficients `beta`.
    ///
    /// # Errors
    /// [`ImplicitError::Body`] where a landmark is missing, or joints do not stand as those of a person do.
    pub fn new(model: &BodyModel, beta: &[f64], bones: &Bones) -> Result<Self, ImplicitError> {
        let shape = model.shape(beta);
        let at = |name: &str| match model.landmark(name) {
            Some(v) => Ok(shape[v as usize].cast::<f64>()),
            None => {
                Err(ImplicitError::Body(format!("the template has no landmark `{name}`, which contours start from")))
            }
        };
        let heights = shape.iter().map(|p| f64::from(p.y)).fold((f64::MAX, f64::MIN), |(l, h), y| (l.min(y), h.max(y)));
        let marks = Self {
            armpits: [at("leftAxilla")?, at("rightAxilla")?],
            crotch: at("crotch")?,
            height: heights.1 - heights.0,
        };
        let height = |j: Joint| bones.at(Place::Joint(j)).y;
        let ascending =
            [Joint::LeftFoot, Joint::LeftLowerLeg, Joint::LeftUpperLeg, Joint::Spine, Joint::Chest, Joint::Neck];
        if ascending.windows(2).any(|w| height(w[1]) - height(w[0]) < 0.02) {
            let reason = "the rest joints do not stand one above the other from foot to neck; give them in the A-pose, in metres";
            return Err(ImplicitError::Body(reason.into()));
        }
        Ok(marks)
    }
}
