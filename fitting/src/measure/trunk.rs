//! Measurements of the trunk.

use nalgebra::{Point3, Vector3};

use crate::measure::{
    definition::{Definition, MeasureKind::*},
    head::height,
    levels::{Levels, around_trunk, between, bust_point, farthest_of, longest},
    parts::Side,
    section::Tape,
    standing::{SideLandmarks, Standing},
    taken::Taken,
};

pub(crate) const SHOULDER_HEIGHT: Definition = Definition {
    name: "shoulder height",
    kind: Height,
    clause: None,
    wording: "height of the shoulder points, mean of both sides",
};
pub(crate) const BUST_HEIGHT: Definition = Definition {
    name: "bust height",
    kind: Height,
    clause: None,
    wording: "height of the bust points (the most forward points of the breasts), mean of both sides",
};
pub(crate) const WAIST_HEIGHT: Definition = Definition {
    name: "waist height",
    kind: Height,
    clause: None,
    wording: "height of the waist level: midway between the lowest rib and the highest point of the hip bone",
};
pub(crate) const HIP_HEIGHT: Definition = Definition {
    name: "hip height",
    kind: Height,
    clause: None,
    wording: "height of the hip level: the greatest prominence of the buttocks",
};
pub(crate) const TROCHANTER_HEIGHT: Definition = Definition {
    name: "trochanter height",
    kind: Height,
    clause: None,
    wording: "height of the trochanter points, mean of both sides",
};
pub(crate) const CROTCH_HEIGHT: Definition = Definition {
    name: "crotch height (inside leg length)",
    kind: Height,
    clause: None,
    wording: "height of the crotch point above the soles",
};
pub(crate) const CHEST_GIRTH: Definition = Definition {
    name: "chest girth",
    kind: Girth,
    clause: None,
    wording: "largest horizontal girth of the trunk from the bust points up to a tape's width under the armpits, arms left out",
};
pub(crate) const BUST_GIRTH: Definition = Definition {
    name: "bust girth",
    kind: Girth,
    clause: Some("5.3.4"),
    wording: "horizontal girth of the trunk at the level of the bust points, arms left out",
};
pub(crate) const WAIST_GIRTH: Definition = Definition {
    name: "waist girth",
    kind: Girth,
    clause: Some("5.3.10"),
    wording: "horizontal girth of the trunk at the waist level: midway between the lowest rib and the highest point of \
              the hip bone",
};
pub(crate) const TOP_HIP_GIRTH: Definition = Definition {
    name: "top hip girth",
    kind: Girth,
    clause: Some("5.3.12"),
    wording: "horizontal girth of the trunk midway between the waist level and the hip level",
};
pub(crate) const HIP_GIRTH: Definition = Definition {
    name: "hip girth",
    kind: Girth,
    clause: Some("5.3.13"),
    wording: "horizontal girth of the trunk at the hip level: the greatest prominence of the buttocks",
};
pub(crate) const SHOULDER_BREADTH: Definition = Definition {
    name: "shoulder breadth",
    kind: Breadth,
    clause: None,
    wording: "straight distance between the shoulder points",
};
pub(crate) const SHOULDER_WIDTH: Definition = Definition {
    name: "shoulder width over the back",
    kind: Length,
    clause: Some("5.4.3"),
    wording: "over the back from one shoulder point through the back neck point to the other shoulder point",
};
pub(crate) const BACK_NECK_TO_WAIST: Definition = Definition {
    name: "back neck to waist",
    kind: Length,
    clause: Some("5.4.5"),
    wording: "over the back from the back neck point down to the waist level",
};
pub(crate) const FRONT_NECK_TO_WAIST: Definition = Definition {
    name: "front neck to waist",
    kind: Length,
    clause: None,
    wording: "over the front from the front neck point down to the waist level",
};

/// Takes the measurements of the trunk.
pub(crate) fn measure(body: &Standing, levels: &Levels, taken: &mut Taken) {
    heights(body, levels, taken);
    taken.add(
        &CHEST_GIRTH,
        longest(&body.trunk(), (levels.bust, levels.under_arms)).or(around_trunk(body, levels.bust)),
    );
    taken.add(&BUST_GIRTH, around_trunk(body, levels.bust));
    taken.add(&WAIST_GIRTH, around_trunk(body, levels.waist));
    taken.add(&TOP_HIP_GIRTH, around_trunk(body, levels.top_hip));
    taken.add(&HIP_GIRTH, around_trunk(body, levels.hip));
    taken.add(&SHOULDER_BREADTH, Some(Tape::along(Side::BOTH.map(|s| body.side(s).shoulder).to_vec())));
    let [left, right] = Side::BOTH.map(|side| back_neck_to_shoulder(body, side));
    taken.add(&SHOULDER_WIDTH, left.zip(right).map(|(left, right)| left.reversed().then(right)));
    taken.add(&BACK_NECK_TO_WAIST, down_to_waist(body, levels, body.landmarks.back_neck, -Vector3::z()));
    taken.add(&FRONT_NECK_TO_WAIST, down_to_waist(body, levels, body.landmarks.front_neck, Vector3::z()));
}

fn heights(body: &Standing, levels: &Levels, taken: &mut Taken) {
    let both = |of: fn(&SideLandmarks) -> Point3<f64>| between(Side::BOTH.map(|side| of(body.side(side))));
    let in_the_middle = |y: f64| Point3::new(body.landmarks.navel.x, y, 0.0);
    taken.add(&SHOULDER_HEIGHT, Some(height(&both(|s| s.shoulder))));
    taken.add(&BUST_HEIGHT, Some(height(&between(Side::BOTH.map(|side| bust_point(body, side))))));
    taken.add(&WAIST_HEIGHT, Some(height(&in_the_middle(levels.waist))));
    taken.add(&HIP_HEIGHT, Some(height(&in_the_middle(levels.hip))));
    taken.add(&TROCHANTER_HEIGHT, Some(height(&both(|s| s.trochanter))));
    taken.add(&CROTCH_HEIGHT, Some(height(&body.landmarks.crotch)));
}

/// Over the back from the back neck point to a shoulder point.
pub(crate) fn back_neck_to_shoulder(body: &Standing, side: Side) -> Option<Tape> {
    body.whole().taut(&body.landmarks.back_neck, &body.side(side).shoulder, &Vector3::new(0.0, 0.5, -1.0))
}

/// Over the surface from a point straight down to the waist level, on the side of the body that `out` points to.
fn down_to_waist(body: &Standing, levels: &Levels, start: Point3<f64>, out: Vector3<f64>) -> Option<Tape> {
    let waist = around_trunk(body, levels.waist)?;
    let end = farthest_of(&waist, |p| p.coords.dot(&out))?;
    body.whole().taut(&start, &Point3::new(start.x, levels.waist, end.z), &out)
}
