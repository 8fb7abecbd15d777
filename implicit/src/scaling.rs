//! Bodies of other sizes and proportions by five operators (paper 002 §5).
//!
//! In two steps: the total height scales everything alike; then, along independent directions, the frontal one, the lateral one of the
//! higher body and of the lower body, and how high the spine begins while the height stays. The skeleton is scaled first;
//! each primitive follows: its principal directions are tagged lateral, frontal or vertical by their dominant component, the half axes and the
//! centre are scaled by their own ratios, the orientation is kept.
//!
//! Here y is up, x lateral and z frontal. Head, hands and feet are scaled by the height alone; so are the heights of ankles
//! above the soles and of the crown above the head's joint, and the spine's origin is that of the legs.

use nalgebra::{Matrix3, Vector3};
use toile_character::{Joint, Skeleton, joint::JOINTS};

use crate::{
    ImplicitError,
    body::ImplicitBody,
    bones::{Bones, Place},
    group::Group,
    primitive::Primitive,
    state::State,
};

/// The five operators; 1 changes nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scaling {
    /// All directions, as a factor: the total height.
    pub total_height: f64,
    /// Front to back, as a factor.
    pub frontal: f64,
    /// From side to side above the spine's origin, as a factor.
    pub high_lateral: f64,
    /// From side to side below it, as a factor.
    pub low_lateral: f64,
    /// Height of the spine's origin over the total height, as a factor of what it is.
    pub spine_origin: f64,
}

impl Default for Scaling {
    fn default() -> Self {
        Self { total_height: 1.0, frontal: 1.0, high_lateral: 1.0, low_lateral: 1.0, spine_origin: 1.0 }
    }
}

/// Sizes of a skeleton that a scaling can be given by, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dimensions {
    /// From the soles to the crown.
    pub stature: f64,
    /// Between the joints of the upper arms.
    pub shoulders: f64,
    /// Between the joints of the upper legs.
    pub hips: f64,
    /// Height of the spine's origin, midway between the joints of the upper legs.
    pub spine_origin: f64,
}

/// Factors beyond which nobody's proportions go: a stature from 0.5 m for a new-born child to 2.7 m for the tallest man known, around 1.7 m.
const RANGE: (f64, f64) = (0.25, 4.0);

impl Dimensions {
    /// Of a skeleton whose person stands from `soles` to `crown` (heights, metres).
    pub fn of(skeleton: &Skeleton, soles: f64, crown: f64) -> Self {
        let across = |a: Joint, b: Joint| (skeleton.position(a).x - skeleton.position(b).x).abs();
        Self {
            stature: crown - soles,
            shoulders: across(Joint::LeftUpperArm, Joint::RightUpperArm),
            hips: across(Joint::LeftUpperLeg, Joint::RightUpperLeg),
            spine_origin: seat(skeleton) - soles,
        }
    }

    /// The scaling that makes these dimensions of `from`; the frontal factor is given.
    pub fn scaling_from(&self, from: &Self, frontal: f64) -> Scaling {
        let total_height = self.stature / from.stature;
        Scaling {
            total_height,
            frontal,
            high_lateral: self.shoulders / from.shoulders / total_height,
            low_lateral: self.hips / from.hips / total_height,
            spine_origin: self.spine_origin / from.spine_origin / total_height,
        }
    }
}

/// Height of the spine's origin.
fn seat(skeleton: &Skeleton) -> f64 {
    Bones::new(skeleton, &toile_character::Pose::identity()).at(Place::Seat).y
}

/// Factors along x, y and z in a part of the body.
#[derive(Debug, Clone, Copy)]
struct Ratios {
    high: Vector3<f64>,
    low: Vector3<f64>,
}

impl Ratios {
    /// Of the part that a primitive's or joint's `group` is in.
    fn of(&self, joint: Joint) -> Vector3<f64> {
        use Group::*;
        match Group::of_joint(joint) {
            Hip | LeftUpperLeg | LeftLowerLeg | RightUpperLeg | RightLowerLeg | LeftAnkle | RightAnkle => self.low,
            _ => self.high,
        }
    }
}

impl Scaling {
    /// `body`, who stands with the soles at 0 and the top of the head at `stature` (metres), scaled.
    ///
    /// # Errors
    /// [`ImplicitError::Body`] where a factor is not a number between a quarter and four, or the spine would begin above the neck.
    pub fn of(&self, body: &ImplicitBody, stature: f64) -> Result<ImplicitBody, ImplicitError> {
        let factors = [
            ("total height", self.total_height),
            ("frontal", self.frontal),
            ("high lateral", self.high_lateral),
            ("low lateral", self.low_lateral),
            ("spine origin", self.spine_origin),
        ];
        if let Some((name, factor)) = factors.into_iter().find(|(_, f)| !(RANGE.0..=RANGE.1).contains(f)) {
            let reason =
                format!("the {name} factor {factor} is not between {} and {}; 1 changes nothing", RANGE.0, RANGE.1);
            return Err(ImplicitError::Body(reason));
        }
        let heights = self.heights(&body.skeleton, stature)?;
        let ratios = self.ratios(&heights);
        let mut scaled = body.clone();
        scaled.scale *= self.total_height;
        scaled.skeleton = self.skeleton(&body.skeleton, &ratios, &heights);
        scaled.primitives = body.primitives.iter().map(|p| primitive(p, &ratios.of(p.joint))).collect();
        Ok(scaled)
    }

    /// Where the vertical scale changes, before and after.
    fn heights(&self, skeleton: &Skeleton, stature: f64) -> Result<Heights, ImplicitError> {
        let at = |joint: Joint| skeleton.position(joint).y;
        let (ankle, origin, head) =
            (0.5 * (at(Joint::LeftFoot) + at(Joint::RightFoot)), seat(skeleton), at(Joint::Head));
        let high = self.total_height;
        let wanted = self.spine_origin * high * origin;
        let heights = Heights { from: [ankle, origin, head], to: [high * ankle, wanted, high * head] };
        if wanted < 1.2 * high * ankle || wanted > 0.9 * high * head {
            let reason = format!(
                "a spine that begins {:.2} m up leaves no legs or no trunk to a stature of {:.2} m; choose another spine origin",
                wanted,
                high * stature
            );
            return Err(ImplicitError::Body(reason));
        }
        Ok(heights)
    }

    fn ratios(&self, heights: &Heights) -> Ratios {
        let [legs, trunk] = heights.slopes();
        let all = self.total_height;
        Ratios {
            high: Vector3::new(all * self.high_lateral, trunk, all * self.frontal),
            low: Vector3::new(all * self.low_lateral, legs, all * self.frontal),
        }
    }

    fn skeleton(&self, from: &Skeleton, ratios: &Ratios, heights: &Heights) -> Skeleton {
        let mut to = from.clone();
        for joint in JOINTS {
            let (old, ratio) = (from.position(joint), ratios.of(joint));
            let place = &mut to.rest[joint.index()];
            place.x = old.x * ratio.x;
            place.y = heights.map(old.y);
            place.z = old.z * ratio.z;
        }
        // fingers, toes and eyes are as large as hand, foot and head
        for joint in JOINTS.into_iter().filter(|j| is_in_extremity(*j)) {
            if let Some(parent) = joint.parent() {
                let offset = (from.position(joint) - from.position(parent)) * self.total_height;
                to.rest[joint.index()] = to.position(parent) + offset;
            }
        }
        to
    }
}

/// Whether a joint lies inside of a hand, foot or head.
fn is_in_extremity(joint: Joint) -> bool {
    let inside = |parent: Joint| {
        use Joint::*;
        matches!(parent, Head | LeftHand | RightHand | LeftFoot | RightFoot) || parent.is_finger()
    };
    joint.parent().is_some_and(inside)
}

/// Heights where the vertical scale changes: ankles, the spine's origin, the head's joint.
#[derive(Debug)]
struct Heights {
    from: [f64; 3],
    to: [f64; 3],
}

impl Heights {
    /// Of the legs and of the trunk.
    fn slopes(&self) -> [f64; 2] {
        [0, 1].map(|k| (self.to[k + 1] - self.to[k]) / (self.from[k + 1] - self.from[k]))
    }

    fn map(&self, y: f64) -> f64 {
        let ends = self.to[0] / self.from[0];
        match y {
            y if y <= self.from[0] => y * ends,
            y if y <= self.from[1] => self.to[0] + (y - self.from[0]) * self.slopes()[0],
            y if y <= self.from[2] => self.to[1] + (y - self.from[1]) * self.slopes()[1],
            y => self.to[2] + (y - self.from[2]) * ends,
        }
    }
}

/// A primitive with its axes and centre scaled by factors along x, y and z.
fn primitive(p: &Primitive, ratio: &Vector3<f64>) -> Primitive {
    let mut scaled = p.clone();
    scaled.state = state(&p.state, ratio);
    if let Some(deform) = &mut scaled.deform {
        (deform.at_min, deform.at_max) = (state(&deform.at_min, ratio), state(&deform.at_max, ratio));
    }
    scaled
}

/// Each half axis is scaled by the factor of the direction that dominates it; the orientation stays.
fn state(s: &State, ratio: &Vector3<f64>) -> State {
    let directions: Matrix3<f64> = *s.rotation().to_rotation_matrix().matrix();
    let tag = |axis: usize| directions.column(axis).iamax();
    let axes = Vector3::from_fn(|axis, _| s.axes[axis] * ratio[tag(axis)]);
    State { axes, center: s.center.component_mul(ratio), turn: s.turn }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, UnitQuaternion};
    use toile_character::BodyModel;

    use super::*;
    use crate::field_function::FieldFunction;

    const STATURE: f64 = 1.7;

    fn ball(joint: Joint, turn: Vector3<f64>) -> Primitive {
        let state = State { axes: Vector3::new(0.03, 0.08, 0.05), center: Vector3::new(0.02, -0.1, 0.04), turn };
        Primitive::metaball(joint, state)
    }

    fn body() -> ImplicitBody {
        let skeleton = BodyModel::load_default().unwrap().mean_skeleton;
        let primitives = vec![
            ball(Joint::LeftUpperArm, Vector3::zeros()),
            ball(Joint::LeftLowerLeg, Vector3::zeros()),
            ball(Joint::Chest, Vector3::new(0.0, 0.0, 80f64.to_radians())),
        ];
        ImplicitBody {
            name: "person".into(),
            field: FieldFunction::Wyvill,
            skeleton,
            beta: Vec::new(),
            scale: 1.0,
            primitives,
        }
    }

    fn at(body: &ImplicitBody, joint: Joint) -> Point3<f64> {
        body.skeleton.position(joint)
    }

    fn near(a: Vector3<f64>, b: Vector3<f64>) -> bool {
        (a - b).norm() < 1e-12
    }

    #[test]
    fn the_total_height_scales_everything_alike() {
        let (body, scaling) = (body(), Scaling { total_height: 1.1, ..Scaling::default() });
        let tall = scaling.of(&body, STATURE).unwrap();
        for joint in JOINTS {
            assert!(near(at(&tall, joint).coords, at(&body, joint).coords * 1.1), "{joint:?}");
        }
        for (a, b) in tall.primitives.iter().zip(&body.primitives) {
            assert!(near(a.state.axes, b.state.axes * 1.1) && near(a.state.center, b.state.center * 1.1));
            assert_eq!(a.state.turn, b.state.turn);
        }
        assert!((tall.scale - 1.1).abs() < 1e-12);
        assert_eq!(Scaling::default().of(&body, STATURE).unwrap(), body);
    }

    #[test]
    fn frontal_and_lateral_scales_change_their_direction_and_their_part_alone() {
        let body = body();
        let by = Scaling { frontal: 1.2, high_lateral: 1.3, low_lateral: 0.8, ..Scaling::default() };
        let scaled = by.of(&body, STATURE).unwrap();
        for (joint, x) in
            [(Joint::LeftUpperArm, 1.3), (Joint::RightHand, 1.3), (Joint::LeftLowerLeg, 0.8), (Joint::Hips, 0.8)]
        {
            let expected = at(&body, joint).coords.component_mul(&Vector3::new(x, 1.0, 1.2));
            assert!(near(at(&scaled, joint).coords, expected), "{joint:?}");
        }
        let [arm, leg, chest] = [0, 1, 2].map(|k| scaled.primitives[k].state);
        assert!(near(arm.axes, Vector3::new(0.03 * 1.3, 0.08, 0.05 * 1.2)));
        assert!(near(arm.center, Vector3::new(0.02 * 1.3, -0.1, 0.04 * 1.2)));
        assert!(near(leg.axes, Vector3::new(0.03 * 0.8, 0.08, 0.05 * 1.2)));
        // its first axis is turned to the vertical, its second one to the lateral direction
        assert!(near(chest.axes, Vector3::new(0.03, 0.08 * 1.3, 0.05 * 1.2)));
        assert_eq!(chest.turn, body.primitives[2].state.turn);
    }

    #[test]
    fn the_spines_origin_moves_and_the_height_stays() {
        let body = body();
        let long_legged = Scaling { spine_origin: 1.1, ..Scaling::default() }.of(&body, STATURE).unwrap();
        let (before, after) = (seat(&body.skeleton), seat(&long_legged.skeleton));
        assert!((after - 1.1 * before).abs() < 1e-9, "{after} {before}");
        for joint in [Joint::Head, Joint::LeftFoot] {
            assert!((at(&long_legged, joint).y - at(&body, joint).y).abs() < 0.003, "{joint:?}");
        }
        let ankle = 0.5 * (at(&body, Joint::LeftFoot).y + at(&body, Joint::RightFoot).y);
        let longer = (1.1 * before - ankle) / (before - ankle);
        let knee = |b: &ImplicitBody| at(b, Joint::LeftLowerLeg).y - ankle;
        assert!((knee(&long_legged) - longer * knee(&body)).abs() < 1e-9);
        assert!((long_legged.primitives[1].state.axes.y - 0.08 * longer).abs() < 1e-9, "legs are longer");
        assert!(long_legged.primitives[0].state.axes.y < 0.08, "what is above is shorter");
        assert!(at(&long_legged, Joint::Neck).y > at(&body, Joint::Neck).y);
    }

    #[test]
    fn typed_dimensions_are_met_by_the_skeleton() {
        let body = body();
        let now = Dimensions::of(&body.skeleton, 0.0, STATURE);
        let wanted = Dimensions { stature: 1.85, shoulders: 0.4, hips: 0.2, spine_origin: 0.98 };
        let scaled = wanted.scaling_from(&now, 1.05).of(&body, STATURE).unwrap();
        let is = Dimensions::of(&scaled.skeleton, 0.0, 1.85);
        for (a, b) in [(is.shoulders, 0.4), (is.hips, 0.2), (is.spine_origin, 0.98)] {
            assert!((a - b).abs() < 1e-9, "{is:?}");
        }
    }

    #[test]
    fn a_tag_is_the_dominant_direction_whatever_the_turn() {
        for degrees in [0.0f64, 40.0, 50.0, 130.0, 140.0, 220.0, 310.0] {
            let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * degrees.to_radians());
            let start = State { axes: Vector3::new(0.1, 0.2, 0.3), center: Vector3::zeros(), turn: Vector3::zeros() };
            let scaled = state(&start.turned(&turn), &Vector3::new(2.0, 1.0, 1.0));
            let is_lateral = degrees.to_radians().cos().abs() > degrees.to_radians().sin().abs();
            let expected = if is_lateral { Vector3::new(0.2, 0.2, 0.3) } else { Vector3::new(0.1, 0.4, 0.3) };
            assert!(near(scaled.axes, expected), "{degrees}");
        }
    }

    #[test]
    fn factors_that_nobody_has_are_refused() {
        let wrong = [
            Scaling { frontal: 0.0, ..Scaling::default() },
            Scaling { total_height: f64::NAN, ..Scaling::default() },
            Scaling { spine_origin: 1.9, ..Scaling::default() },
            Scaling { low_lateral: -1.0, ..Scaling::default() },
        ];
        for scaling in wrong {
            let error = scaling.of(&body(), STATURE).unwrap_err().to_string();
            assert!(error.contains("between 0.25 and 4") || error.contains("spine"), "{error}");
        }
    }
}
