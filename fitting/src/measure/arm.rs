//! Measurements of an arm.

use nalgebra::{Point3, Vector3, center};
use toile_character::Joint;

use crate::measure::{
    definition::{Definition, MeasureKind::*},
    parts::Side,
    section::{Plane, Tape},
    standing::Standing,
    taken::Taken,
    trunk::back_neck_to_shoulder,
};

pub(crate) const UPPER_ARM_GIRTH: Definition = Definition {
    name: "upper arm girth",
    kind: Girth,
    clause: Some("5.3.16"),
    wording: "girth across the upper arm, midway between the shoulder point and the elbow point",
};
pub(crate) const ELBOW_GIRTH: Definition = Definition {
    name: "elbow girth",
    kind: Girth,
    clause: None,
    wording: "girth of the straight elbow across the arm, through the elbow's joint",
};
pub(crate) const FOREARM_GIRTH: Definition =
    Definition { name: "forearm girth", kind: Girth, clause: None, wording: "largest girth across the forearm" };
pub(crate) const WRIST_GIRTH: Definition = Definition {
    name: "wrist girth",
    kind: Girth,
    clause: Some("5.3.19"),
    wording: "girth across the arm at the wrist point",
};
pub(crate) const UPPER_ARM_LENGTH: Definition = Definition {
    name: "upper arm length",
    kind: Length,
    clause: None,
    wording: "over the outside of the arm from the shoulder point to the elbow point",
};
pub(crate) const LOWER_ARM_LENGTH: Definition = Definition {
    name: "lower arm length",
    kind: Length,
    clause: None,
    wording: "over the outside of the arm from the elbow point to the wrist point",
};
pub(crate) const ARM_LENGTH: Definition = Definition {
    name: "arm length",
    kind: Length,
    clause: Some("5.7.8"),
    wording: "over the outside of the arm from the shoulder point over the elbow point to the wrist point",
};
pub(crate) const BACK_NECK_TO_WRIST: Definition = Definition {
    name: "back neck to wrist length",
    kind: Length,
    clause: Some("5.4.17"),
    wording: "from the back neck point over the shoulder point and the elbow point to the wrist point",
};
pub(crate) const HAND_LENGTH: Definition = Definition {
    name: "hand length",
    kind: Breadth,
    clause: None,
    wording: "straight distance from the wrist point to the tip of the middle finger",
};

/// Part of the way from elbow to wrist in which the largest girth of the forearm is searched.
const FOREARM: std::ops::RangeInclusive<f64> = 0.1..=0.6;
/// Sections that are tried along the forearm.
const SECTIONS: u32 = 16;

/// Takes the measurements of one arm.
pub(crate) fn measure(body: &Standing, side: Side, taken: &mut Taken) {
    let arm = Arm::of(body, side);
    taken.add_side(side, &UPPER_ARM_GIRTH, arm.upper_arm_girth());
    taken.add_side(side, &ELBOW_GIRTH, arm.across(arm.elbow, arm.wrist - arm.shoulder));
    taken.add_side(side, &FOREARM_GIRTH, arm.forearm_girth());
    taken.add_side(side, &WRIST_GIRTH, arm.across(body.side(side).wrist, arm.wrist - arm.elbow));
    lengths(body, side, taken);
}

fn lengths(body: &Standing, side: Side, taken: &mut Taken) {
    let marks = body.side(side);
    let outside = Vector3::new(side.sign(), 1.0, 0.0);
    let over = |a: &Point3<f64>, b: &Point3<f64>| body.arm(side).taut(a, b, &outside);
    let (upper, lower) = (over(&marks.shoulder, &marks.elbow), over(&marks.elbow, &marks.wrist));
    let whole = upper.clone().zip(lower.clone()).map(|(upper, lower)| upper.then(lower));
    let from_neck = back_neck_to_shoulder(body, side).zip(whole.clone()).map(|(back, arm)| back.then(arm));
    taken.add_side(side, &UPPER_ARM_LENGTH, upper);
    taken.add_side(side, &LOWER_ARM_LENGTH, lower);
    taken.add_side(side, &ARM_LENGTH, whole);
    taken.add_side(side, &BACK_NECK_TO_WRIST, from_neck);
    taken.add_side(side, &HAND_LENGTH, Some(Tape::along(vec![marks.wrist, marks.finger_tip])));
}

/// An arm's joints and surface.
struct Arm<'a> {
    body: &'a Standing,
    side: Side,
    shoulder: Point3<f64>,
    elbow: Point3<f64>,
    wrist: Point3<f64>,
}

impl<'a> Arm<'a> {
    fn of(body: &'a Standing, side: Side) -> Self {
        use Joint::*;
        let [shoulder, elbow, wrist] = match side {
            Side::Left => [LeftUpperArm, LeftLowerArm, LeftHand],
            Side::Right => [RightUpperArm, RightLowerArm, RightHand],
        }
        .map(|joint| body.joint(joint));
        Self { body, side, shoulder, elbow, wrist }
    }

    fn across(&self, point: Point3<f64>, along: Vector3<f64>) -> Option<Tape> {
        self.body.arm(self.side).girth_near(&Plane::across(point, &along)?)
    }

    fn upper_arm_girth(&self) -> Option<Tape> {
        let marks = self.body.side(self.side);
        let bone = (self.elbow - self.shoulder).try_normalize(1e-9)?;
        let middle = center(&marks.shoulder, &marks.elbow);
        self.across(self.shoulder + bone * (middle - self.shoulder).dot(&bone), bone)
    }

    fn forearm_girth(&self) -> Option<Tape> {
        let bone = self.wrist - self.elbow;
        let at = |k: u32| FOREARM.start() + (FOREARM.end() - FOREARM.start()) * f64::from(k) / f64::from(SECTIONS);
        (0..=SECTIONS)
            .filter_map(|k| self.across(self.elbow + bone * at(k), bone))
            .reduce(|a, b| if b.length > a.length { b } else { a })
    }
}
