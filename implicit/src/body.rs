//! A body of primitives.

use toile_character::Skeleton;

use crate::{ImplicitError, field_function::FieldFunction, group::Group, primitive::Primitive};

/// A body of primitives on a skeleton, with the shape that its head, hands and feet have.
#[derive(Debug, Clone, PartialEq)]
pub struct ImplicitBody {
    /// Name of the person.
    pub name: String,
    /// How strength falls with distance.
    pub field: FieldFunction,
    /// Rest joints in the A-pose, metres.
    pub skeleton: Skeleton,
    /// Coefficients of the body model that head, hands and feet are taken from.
    pub beta: Vec<f64>,
    /// Size of head, hands and feet beside those of the body model with these coefficients.
    pub scale: f64,
    /// The primitives.
    pub primitives: Vec<Primitive>,
}

impl ImplicitBody {
    /// Checks what contours rely on: every group has a primitive with a positive weight.
    ///
    /// # Errors
    /// [`ImplicitError::Body`] names the first group that has none.
    pub fn validate(&self) -> Result<(), ImplicitError> {
        let is_in = |p: &Primitive, g: Group| p.weight > 0.0 && p.groups.contains(g);
        let bare = Group::ALL.into_iter().find(|&g| !self.primitives.iter().any(|p| is_in(p, g)));
        match bare {
            Some(group) => Err(ImplicitError::Body(format!(
                "the body has no primitive in the group `{}`, so no skin can be drawn there; add one with a positive weight",
                group.name()
            ))),
            None => Ok(()),
        }
    }
}
