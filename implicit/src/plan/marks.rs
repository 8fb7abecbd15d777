//! Where on the person the pieces of skin meet: read off the template's landmarks.

use nalgebra::Point3;
use toile_character::{BodyModel, Joint, Pose};

use crate::{
    ImplicitError,
    body::ImplicitBody,
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
    /// On `body`: those of the model with its coefficients lie beside its joints as they do beside the model's.
    ///
    /// # Errors
    /// [`ImplicitError::Body`] where a landmark is missing, or joints do not stand as those of a person do.
    pub fn new(model: &BodyModel, body: &ImplicitBody, bones: &Bones) -> Result<Self, ImplicitError> {
        let shape = model.shape(&body.beta);
        let own = Bones::new(&model.skeleton_at(&body.beta), &Pose::identity());
        let beside = |place: Place, p: Point3<f64>| bones.at(place) + (p - own.at(place)) * body.scale;
        let at = |name: &str| match model.landmark(name) {
            Some(v) => Ok(shape[v as usize].cast::<f64>()),
            None => {
                Err(ImplicitError::Body(format!("the template has no landmark `{name}`, which contours start from")))
            }
        };
        let heights = shape.iter().map(|p| f64::from(p.y)).fold((f64::MAX, f64::MIN), |(l, h), y| (l.min(y), h.max(y)));
        let [left, right, foot, head] =
            [Joint::LeftUpperArm, Joint::RightUpperArm, Joint::LeftFoot, Joint::Head].map(Place::Joint);
        let level = |place: Place, y: f64| beside(place, Point3::new(0.0, y, 0.0)).y;
        let marks = Self {
            armpits: [beside(left, at("leftAxilla")?), beside(right, at("rightAxilla")?)],
            crotch: beside(Place::Seat, at("crotch")?),
            height: level(head, heights.1) - level(foot, heights.0),
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
