//! The volume primitives: ellipsoidal metaballs and ellipsoids (paper 002 §1 and §3.2).

use toile_character::Joint;

use crate::{
    deform::Deform,
    group::{Group, Groups},
    state::State,
};

/// How a primitive joins its neighbours.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Kind {
    /// A metaball: its field is added to those of the others.
    #[default]
    Metaball,
    /// A plain ellipsoid: it meets the others in a crease.
    Ellipsoid,
}

/// A volume primitive on its proximal joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Primitive {
    /// A name for people, such as `left biceps`; may be empty.
    pub name: String,
    /// The joint that it moves with.
    pub joint: Joint,
    /// How it joins its neighbours.
    pub kind: Kind,
    /// Strength of a metaball; a negative one presses the surface in.
    pub weight: f64,
    /// Size, place and turn at rest.
    pub state: State,
    /// Groups that it belongs to.
    pub groups: Groups,
    /// How it changes with a joint, for a muscle.
    pub deform: Option<Deform>,
}

impl Primitive {
    /// A metaball of weight 1 in the group of its joint.
    pub fn metaball(joint: Joint, state: State) -> Self {
        let groups = Groups::default().with(Group::of_joint(joint));
        Self { name: String::new(), joint, kind: Kind::Metaball, weight: 1.0, state, groups, deform: None }
    }
}
