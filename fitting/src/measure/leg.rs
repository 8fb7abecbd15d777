//! Measurements of a leg.

use nalgebra::{Point3, Vector3};

use crate::measure::{
    definition::{Definition, MeasureKind::*},
    head::height,
    levels::{Levels, around_trunk, between, farthest_of, longest, shortest_tape},
    parts::Side,
    section::{Plane, Tape},
    standing::Standing,
    taken::Taken,
};

pub(crate) const KNEE_HEIGHT: Definition = Definition {
    name: "knee height",
    kind: Height,
    clause: None,
    wording: "height of the middle of the kneecap, mean of both sides",
};
pub(crate) const ANKLE_HEIGHT: Definition = Definition {
    name: "ankle height",
    kind: Height,
    clause: None,
    wording: "height of the outer ankle point, mean of both sides",
};
pub(crate) const THIGH_GIRTH: Definition = Definition {
    name: "thigh girth",
    kind: Girth,
    clause: Some("5.3.20"),
    wording: "largest horizontal girth of the thigh below the fold of the buttock",
};
pub(crate) const MID_THIGH_GIRTH: Definition = Definition {
    name: "mid-thigh girth",
    kind: Girth,
    clause: Some("5.3.21"),
    wording: "horizontal girth of the thigh midway between the crotch and the middle of the kneecap",
};
pub(crate) const KNEE_GIRTH: Definition = Definition {
    name: "knee girth",
    kind: Girth,
    clause: None,
    wording: "horizontal girth of the straight knee at the middle of the kneecap",
};
pub(crate) const CALF_GIRTH: Definition =
    Definition { name: "calf girth", kind: Girth, clause: None, wording: "largest horizontal girth of the calf" };
pub(crate) const ANKLE_GIRTH: Definition = Definition {
    name: "ankle girth",
    kind: Girth,
    clause: None,
    wording: "smallest horizontal girth of the lower leg, above the ankle bones",
};
pub(crate) const FOOT_LENGTH: Definition = Definition {
    name: "foot length",
    kind: Breadth,
    clause: None,
    wording: "horizontal distance from the heel point to the tip of the longest toe",
};
pub(crate) const OUTSIDE_LEG_LENGTH: Definition = Definition {
    name: "outside leg length",
    kind: Length,
    clause: None,
    wording: "at the side from the waist level over the hip to the trochanter point, then vertically to the floor",
};
pub(crate) const TROCHANTER_TO_FLOOR: Definition = Definition {
    name: "outside leg length from the trochanter",
    kind: Length,
    clause: None,
    wording: "over the outside of the leg from the trochanter point to the floor below the outer ankle point",
};

/// Where the largest girth of the thigh is searched: parts of the way from the crotch to the knee. At the crotch itself the
/// section still holds the buttock.
const THIGH: (f64, f64) = (0.03, 0.18);
/// Where the largest girth of the calf is searched: parts of the way from the knee to the ankle.
const CALF: (f64, f64) = (0.1, 0.6);
/// Where the smallest girth of the lower leg is searched: parts of the way from the knee to the ankle.
const ABOVE_ANKLE: (f64, f64) = (0.7, 0.97);

/// Takes the heights that belong to both legs.
pub(crate) fn measure_heights(body: &Standing, taken: &mut Taken) {
    taken.add(&KNEE_HEIGHT, Some(height(&between(Side::BOTH.map(|side| body.side(side).kneecap)))));
    taken.add(&ANKLE_HEIGHT, Some(height(&between(Side::BOTH.map(|side| body.side(side).ankle)))));
}

/// Takes the measurements of one leg.
pub(crate) fn measure(body: &Standing, levels: &Levels, side: Side, taken: &mut Taken) {
    let (leg, marks) = (body.leg(side), body.side(side));
    let (crotch, knee, ankle) = (body.landmarks.crotch.y, marks.kneecap.y, marks.ankle.y);
    let between = |top: f64, bottom: f64, (from, to): (f64, f64)| {
        (top + to * (bottom - top), top + from * (bottom - top)) // levels rise, parts of the way go down
    };
    let level = |y: f64| leg.girth(&Plane::level(y));
    taken.add_side(side, &THIGH_GIRTH, longest(&leg, between(crotch, knee, THIGH)));
    taken.add_side(side, &MID_THIGH_GIRTH, level(0.5 * (crotch + knee)));
    taken.add_side(side, &KNEE_GIRTH, level(knee));
    taken.add_side(side, &CALF_GIRTH, longest(&leg, between(knee, ankle, CALF)));
    taken.add_side(side, &ANKLE_GIRTH, shortest_tape(&leg, between(knee, ankle, ABOVE_ANKLE)));
    lengths(body, levels, side, taken);
}

fn lengths(body: &Standing, levels: &Levels, side: Side, taken: &mut Taken) {
    let (leg, marks) = (body.leg(side), body.side(side));
    let outside = Vector3::x() * side.sign();
    let floor = |p: &Point3<f64>| Point3::new(p.x, 0.0, p.z);
    taken.add_side(side, &FOOT_LENGTH, Some(Tape::along(vec![floor(&marks.heel), floor(&marks.toe_tip)])));
    let waist = around_trunk(body, levels.waist).and_then(|tape| farthest_of(&tape, |p| p.coords.dot(&outside)));
    let over_the_hip = waist.and_then(|waist| leg.taut(&waist, &marks.trochanter, &outside));
    let to_the_floor = Tape::along(vec![marks.trochanter, floor(&marks.trochanter)]);
    taken.add_side(side, &OUTSIDE_LEG_LENGTH, over_the_hip.map(|hip| hip.then(to_the_floor)));
    taken.add_side(side, &TROCHANTER_TO_FLOOR, leg.taut(&marks.trochanter, &floor(&marks.ankle), &outside));
}
