//! Muscles of a fitted body: primitives that lie where a muscle does follow its reference joint (paper 002 §3.2).
//!
//! The primitive that fills most of a muscle's place becomes that muscle. At rest nothing changes. At the limits of the reference joint a
//! muscle that contracts is shorter and thicker, one that is stretched longer and thinner.

use nalgebra::Vector3;
use toile_character::{Joint, JointLimit, Skeleton, joint_limits};

use crate::{
    body::ImplicitBody,
    deform::{Blending, Deform},
    primitive::{Kind, Primitive},
    state::State,
};

/// A muscle of one side; `Left` stands for either.
struct Muscle {
    name: &'static str,
    /// The bone that it lies on, from one joint to the next.
    bone: [Joint; 2],
    /// Where along the bone its middle lies.
    along: (f64, f64),
    /// The side of the bone: lateral (away from the middle of the body), up, front.
    toward: [f64; 3],
    /// The joint whose turn contracts or stretches it, and the axis of the turn where that has no limits of its own.
    reference: (Joint, Axis),
    /// Length and thickness at the lowest and the highest angle, in those at rest.
    at_min: (f64, f64),
    at_max: (f64, f64),
    blending: Blending,
}

/// An axis of a reference joint and its limits, degrees.
enum Axis {
    /// The joint's first limit: a hinge.
    Hinge,
    /// About x: to the back, to the front (a positive turn about x moves a limb that hangs to the back).
    Swing(f64, f64),
    /// About z, outward: down, up.
    Raise(f64, f64),
}

/// A quarter thicker: an upper arm's girth grows by a tenth when the biceps, half of it, contracts (ANSUR II's flexed biceps is 1.09 times the
/// relaxed upper arm of the body model).
const CONTRACTED: (f64, f64) = (0.85, 1.25);
const TIGHT: (f64, f64) = (0.92, 1.1);
const STRETCHED: (f64, f64) = (1.08, 0.96);
const AT_REST: (f64, f64) = (1.0, 1.0);

/// The default set. Reference joints are those that the muscles move; ranges are those of the American Academy of Orthopaedic Surgeons.
const MUSCLES: [Muscle; 11] = {
    use Axis::{Hinge, Raise, Swing};
    use Blending::{Hyperbolic, Linear, Parabolic};
    use Joint::*;
    const UPPER_ARM: [Joint; 2] = [LeftUpperArm, LeftLowerArm];
    const THIGH: [Joint; 2] = [LeftUpperLeg, LeftLowerLeg];
    const FRONT: [f64; 3] = [0.0, 0.0, 1.0];
    const BACK: [f64; 3] = [0.0, 0.0, -1.0];
    [
        muscle("biceps", UPPER_ARM, (0.35, 0.95), FRONT, (LeftLowerArm, Hinge), (AT_REST, CONTRACTED), Linear),
        muscle("triceps", UPPER_ARM, (0.3, 0.95), BACK, (LeftLowerArm, Hinge), (TIGHT, STRETCHED), Linear),
        muscle(
            "deltoid",
            UPPER_ARM,
            (-0.3, 0.5),
            [1.0, 1.0, 0.0],
            (LeftUpperArm, Raise(-45.0, 135.0)),
            (STRETCHED, TIGHT),
            Hyperbolic,
        ),
        muscle(
            "forearm",
            [LeftLowerArm, LeftHand],
            (0.0, 0.5),
            FRONT,
            (LeftLowerArm, Hinge),
            (AT_REST, TIGHT),
            Parabolic,
        ),
        muscle(
            "pectoral",
            [Chest, UpperChest],
            (-0.5, 2.0),
            [1.0, 0.0, 1.5],
            (LeftUpperArm, Raise(-45.0, 135.0)),
            (TIGHT, STRETCHED),
            Linear,
        ),
        muscle(
            "latissimus",
            [Spine, Chest],
            (-0.5, 2.0),
            [1.5, 0.0, -1.0],
            (LeftUpperArm, Raise(-45.0, 135.0)),
            (TIGHT, STRETCHED),
            Linear,
        ),
        muscle("quadriceps", THIGH, (0.2, 0.9), FRONT, (LeftLowerLeg, Hinge), (AT_REST, STRETCHED), Linear),
        muscle("hamstrings", THIGH, (0.3, 0.9), BACK, (LeftLowerLeg, Hinge), (AT_REST, TIGHT), Parabolic),
        muscle(
            "adductors",
            THIGH,
            (0.0, 0.5),
            [-1.0, 0.0, 0.0],
            (LeftUpperLeg, Swing(-120.0, 20.0)),
            (TIGHT, AT_REST),
            Linear,
        ),
        muscle(
            "calf",
            [LeftLowerLeg, LeftFoot],
            (0.05, 0.55),
            BACK,
            (LeftFoot, Swing(-20.0, 50.0)),
            (STRETCHED, TIGHT),
            Linear,
        ),
        muscle(
            "gluteus",
            [LeftUpperLeg, LeftLowerLeg],
            (-0.3, 0.3),
            BACK,
            (LeftUpperLeg, Swing(-120.0, 20.0)),
            (STRETCHED, TIGHT),
            Hyperbolic,
        ),
    ]
};

#[allow(clippy::too_many_arguments)] // a row of a table
const fn muscle(
    name: &'static str,
    bone: [Joint; 2],
    along: (f64, f64),
    toward: [f64; 3],
    reference: (Joint, Axis),
    (at_min, at_max): ((f64, f64), (f64, f64)),
    blending: Blending,
) -> Muscle {
    Muscle { name, bone, along, toward, reference, at_min, at_max, blending }
}

/// Makes muscles of the primitives of `body` that lie where muscles do; none has a name or follows a joint yet.
pub(crate) fn name_muscles(body: &mut ImplicitBody) {
    let limits = joint_limits(&body.skeleton);
    for muscle in &MUSCLES {
        for is_left in [true, false] {
            let fit = |p: &Primitive| filling(muscle, is_left, p, &body.skeleton);
            let scores: Vec<f64> = body.primitives.iter().map(fit).collect();
            let best = (0..scores.len()).max_by(|&a, &b| scores[a].total_cmp(&scores[b]).then(b.cmp(&a)));
            let Some(best) = best.filter(|&k| scores[k] > 0.0) else { continue };
            let deform = muscle.deform(is_left, &body.primitives[best], &body.skeleton, &limits);
            body.primitives[best].name = format!("{} {}", if is_left { "left" } else { "right" }, muscle.name);
            body.primitives[best].deform = Some(deform);
        }
    }
}

fn of_side(joint: Joint, is_left: bool) -> Joint {
    if is_left { joint } else { joint.mirrored() }
}

/// The volume of `p` where it lies in the muscle's place and is no muscle yet, else 0.
fn filling(muscle: &Muscle, is_left: bool, p: &Primitive, skeleton: &Skeleton) -> f64 {
    let side = if is_left { 1.0 } else { -1.0 };
    let [from, to] = muscle.bone.map(|j| skeleton.position(of_side(j, is_left)));
    let place = skeleton.position(p.joint) + p.state.center;
    let bone = to - from;
    let along = (place - from).dot(&bone) / bone.norm_squared();
    let aside = place - (from + bone * along);
    let toward = Vector3::new(side * muscle.toward[0], muscle.toward[1], muscle.toward[2]).normalize();
    let is_limb = muscle.bone[0].name().starts_with("left");
    let on_bone = !is_limb || p.joint == of_side(muscle.bone[0], is_left) || muscle.along.0 < 0.0 && is_near(p.joint);
    let on_side = is_limb || side * place.x > 0.02;
    let is_there = (muscle.along.0..=muscle.along.1).contains(&along) && aside.dot(&toward) > 0.35 * aside.norm();
    let is_free = p.deform.is_none() && p.name.is_empty() && p.kind == Kind::Metaball && p.weight > 0.0;
    if is_there && on_bone && on_side && is_free { p.state.axes.product() } else { 0.0 }
}

/// Joints of the trunk from which muscles cross to a limb.
fn is_near(joint: Joint) -> bool {
    matches!(joint, Joint::Hips | Joint::LeftShoulder | Joint::RightShoulder)
}

impl Muscle {
    fn deform(&self, is_left: bool, p: &Primitive, skeleton: &Skeleton, limits: &[JointLimit]) -> Deform {
        let reference = of_side(self.reference.0, is_left);
        let (axis, low, high) = match self.reference.1 {
            Axis::Hinge => match limits.iter().find(|l| l.joint == reference) {
                Some(hinge) => (hinge.axis, hinge.low, hinge.high),
                None => (Vector3::x(), 0.0, std::f64::consts::PI),
            },
            Axis::Swing(low, high) => (Vector3::x(), low.to_radians(), high.to_radians()),
            Axis::Raise(low, high) => {
                let up = if is_left { Vector3::z() } else { -Vector3::z() };
                (up, low.to_radians(), high.to_radians())
            }
        };
        let [from, to] = self.bone.map(|j| skeleton.position(of_side(j, is_left)));
        let bone = (to - from).try_normalize(1e-9).unwrap_or_else(Vector3::y);
        let scaled = |(length, thickness)| scaled(&p.state, &bone, length, thickness);
        let (at_min, at_max) = (scaled(self.at_min), scaled(self.at_max));
        Deform { reference, axis, limits: [low.min(0.0), 0.0, high.max(0.0)], at_min, at_max, blending: self.blending }
    }
}

/// A state with the half axis that runs most along `bone` scaled by `length`, the others by `thickness`.
fn scaled(state: &State, bone: &Vector3<f64>, length: f64, thickness: f64) -> State {
    let along = (state.rotation().inverse() * bone).iamax();
    let factor = Vector3::from_fn(|axis, _| if axis == along { length } else { thickness });
    State { axes: state.axes.component_mul(&factor), ..*state }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use toile_character::{BodyModel, Pose};

    use super::*;
    use crate::fit::{FitSettings, fit};

    #[test]
    fn a_fitted_body_has_its_muscles_on_both_sides() {
        let model = BodyModel::load_default().unwrap();
        let body = fit(&model, &model.skinned(&[]), &[], "person", &[], &FitSettings::default()).unwrap().body;
        let muscles: Vec<&Primitive> = body.primitives.iter().filter(|p| p.deform.is_some()).collect();
        let names: BTreeSet<&str> = muscles.iter().map(|p| p.name.as_str()).collect();
        assert_eq!(names.len(), muscles.len(), "each once");
        for name in ["biceps", "triceps", "quadriceps", "hamstrings", "calf", "pectoral", "latissimus"] {
            for side in ["left", "right"] {
                assert!(names.contains(format!("{side} {name}").as_str()), "{side} {name} of {names:?}");
            }
        }
        let biceps = muscles.iter().find(|p| p.name == "left biceps").unwrap();
        let deform = biceps.deform.unwrap();
        assert_eq!(deform.reference, Joint::LeftLowerArm);
        let mut bent = Pose::identity();
        *bent.rotation_mut(Joint::LeftLowerArm) =
            nalgebra::UnitQuaternion::from_scaled_axis(deform.axis * deform.limits[2]);
        let contracted = deform.state(&biceps.state, deform.angle(&bent));
        let grown = contracted.axes.component_div(&biceps.state.axes);
        assert!((grown.min() - 0.85).abs() < 1e-6 && (grown.max() - 1.25).abs() < 1e-6, "{grown}");
        assert_eq!(deform.state(&biceps.state, 0.0), biceps.state, "at rest nothing changes");
    }
}
