//! The first primitives: spread over the body so that thick parts have few large ones and thin parts many small ones.

use nalgebra::{UnitQuaternion, Vector3};
use toile_character::Joint;

use super::samples::{Sample, Samples};
use crate::{body::ImplicitBody, primitive::Primitive, state::State};

/// Farthest distance of a skin point from the nearest chosen one, in depths of the body there.
const SPREAD: f64 = 1.25;
/// Where a primitive lies on the way from the link to the skin, and its half axes along the ray and across, in depths.
const PLACE: f64 = 0.6;
const AXES: (f64, f64) = (0.36, 0.55);

/// Half axes are kept within these, metres: from a tendon to half a trunk.
pub(super) const SIZES: (f64, f64) = (0.012, 0.28);

/// First primitives for the samples at rest.
pub(super) fn primitives(body: &ImplicitBody, samples: &Samples) -> Vec<Primitive> {
    let rest = samples.rest();
    let mut nearest = vec![f64::MAX; rest.len()];
    let mut out = Vec::new();
    let mut next = 0;
    while nearest.get(next).is_some_and(|&d| d > SPREAD) {
        let chosen = &rest[next];
        out.push(primitive(body, chosen, PLACE * chosen.depth, AXES.0 * chosen.depth, AXES.1 * chosen.depth));
        for (near, s) in nearest.iter_mut().zip(rest) {
            let scale = 0.5 * (s.depth + chosen.depth);
            let apart = (s.point - chosen.point).norm() / scale.max(1e-3);
            // limbs that touch are far apart
            *near = near.min(if s.group.meets(chosen.group) { apart } else { f64::MAX });
        }
        next = (0..rest.len()).max_by(|&a, &b| nearest[a].total_cmp(&nearest[b]).then(b.cmp(&a))).unwrap_or(0);
    }
    out
}

/// A primitive under a skin point: `along` the ray from the link, half axes along it and across.
pub(super) fn primitive(body: &ImplicitBody, under: &Sample, along: f64, radial: f64, across: f64) -> Primitive {
    let joint = if under.joint.is_finger() { hand_of(under.joint) } else { under.joint };
    let center = under.point - under.direction * (under.depth - along) - body.skeleton.position(joint);
    let rotation = UnitQuaternion::rotation_between(&Vector3::x(), &under.direction).unwrap_or_default();
    let axes = Vector3::new(radial, across, across).map(|a| a.clamp(SIZES.0, SIZES.1));
    Primitive::metaball(joint, State { axes, center, turn: Vector3::zeros() }.turned(&rotation))
}

fn hand_of(finger: Joint) -> Joint {
    if finger.name().starts_with("left") { Joint::LeftHand } else { Joint::RightHand }
}
