//! Measurements of head and neck.

use nalgebra::{Point3, Vector3, center};
use toile_character::Joint;

use crate::measure::{
    definition::{Definition, MeasureKind::*},
    section::{Plane, Tape},
    standing::Standing,
    taken::Taken,
};

pub(crate) const STATURE: Definition = Definition {
    name: "stature",
    kind: Height,
    clause: None,
    wording: "vertical distance from the soles to the top of the head",
};
pub(crate) const CHIN_HEIGHT: Definition =
    Definition { name: "chin height", kind: Height, clause: None, wording: "height of the chin point" };
pub(crate) const BACK_NECK_HEIGHT: Definition = Definition {
    name: "back neck height",
    kind: Height,
    clause: None,
    wording: "height of the back neck point (seventh cervical vertebra)",
};
pub(crate) const FRONT_NECK_HEIGHT: Definition = Definition {
    name: "front neck height",
    kind: Height,
    clause: None,
    wording: "height of the front neck point (the notch above the breastbone)",
};
pub(crate) const HEAD_GIRTH: Definition = Definition {
    name: "head girth",
    kind: Girth,
    clause: None,
    wording: "girth of the head over the forehead point and the back of the head",
};
pub(crate) const HEAD_LENGTH: Definition = Definition {
    name: "head length",
    kind: Breadth,
    clause: None,
    wording: "straight distance from the forehead point to the back of the head",
};
pub(crate) const NECK_GIRTH: Definition = Definition {
    name: "neck girth",
    kind: Girth,
    clause: Some("5.3.2"),
    wording: "girth of the neck across its axis, just below the Adam's apple; taken as the smallest girth between the \
              neck's and the head's joint",
};

/// Part of the way from the neck's joint to the head's in which the smallest girth is searched: below it the shoulders
/// begin, above it the jaw.
const NECK: std::ops::RangeInclusive<f64> = 0.1..=0.9;
/// Sections that are tried along the neck.
const NECK_SECTIONS: u32 = 16;

/// Takes the measurements of head and neck.
pub(crate) fn measure(body: &Standing, stature: f64, taken: &mut Taken) {
    let marks = &body.landmarks;
    let top = Point3::new(marks.top_of_head.x, stature, marks.top_of_head.z);
    taken.add(&STATURE, Some(height(&top)));
    taken.add(&CHIN_HEIGHT, Some(height(&marks.chin)));
    taken.add(&BACK_NECK_HEIGHT, Some(height(&marks.back_neck)));
    taken.add(&FRONT_NECK_HEIGHT, Some(height(&marks.front_neck)));
    taken.add(&HEAD_GIRTH, head_girth(body));
    taken.add(&HEAD_LENGTH, Some(Tape::along(vec![marks.forehead, marks.back_of_head])));
    taken.add(&NECK_GIRTH, neck_girth(body));
}

/// The vertical from the floor to a point.
pub(crate) fn height(p: &Point3<f64>) -> Tape {
    Tape::along(vec![Point3::new(p.x, 0.0, p.z), *p])
}

fn head_girth(body: &Standing) -> Option<Tape> {
    let (front, back) = (body.landmarks.forehead, body.landmarks.back_of_head);
    let plane = Plane::across(center(&front, &back), &(back - front).cross(&Vector3::x()))?;
    body.head_and_neck().girth_near(&plane)
}

fn neck_girth(body: &Standing) -> Option<Tape> {
    let (neck, head) = (body.joint(Joint::Neck), body.joint(Joint::Head));
    let at = |k: u32| NECK.start() + (NECK.end() - NECK.start()) * f64::from(k) / f64::from(NECK_SECTIONS);
    (0..=NECK_SECTIONS)
        .filter_map(|k| Plane::across(neck + (head - neck) * at(k), &(head - neck)))
        .filter_map(|plane| body.head_and_neck().girth_near(&plane))
        .reduce(|a, b| if b.length < a.length { b } else { a })
}
