//! Heights of the trunk's tapes, found on the person's own surface.

use nalgebra::{Point3, center};

use crate::measure::{
    parts::Side,
    section::{Plane, Skin, Tape},
    standing::Standing,
};

/// Distance between two levels that are tried, metres: a tenth of the width of a tape.
const STEP: f64 = 0.002;
/// Width of a tape, metres: it lies this far under the armpit.
pub(crate) const TAPE_WIDTH: f64 = 0.02;
/// How far above and below the nipple, and to its sides, the most forward point of the breast is searched, metres: about
/// half the height of a breast.
const BREAST: f64 = 0.04;
/// How far above and below the template's point the most prominent point of the buttocks is searched, metres: a third of
/// the height of the buttocks.
const BUTTOCK: f64 = 0.05;
/// How much of a prominence is given up for nearness to the template's point, metres for each square metre. A breast and
/// a buttock have radii of some 6 and 10 cm in profile, so that they fall off by 8 and 5 metres for each square metre: the
/// level of a clear prominence moves by two fifths of its distance from the template's point, which is a centimetre or two
/// away. A flat one, which a millimetre of noise would move by centimetres, stays near that point, and so does the bust of a
/// person whose belly is farther forward than the breast.
const BREAST_PULL: f64 = 5.0;
const BUTTOCK_PULL: f64 = 3.0;

/// Heights above the soles, metres.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Levels {
    /// A tape's width under the lower of the two armpits.
    pub under_arms: f64,
    /// Of the bust points.
    pub bust: f64,
    /// Midway between the lowest rib and the highest point of the hip bone.
    pub waist: f64,
    /// Midway between waist and hip.
    pub top_hip: f64,
    /// Of the greatest prominence of the buttocks.
    pub hip: f64,
}

impl Levels {
    /// Finds the levels of a standing body.
    pub fn find(body: &Standing) -> Self {
        let [left, right] = &body.landmarks.sides;
        let waist = 0.5 * (left.waist().y + right.waist().y);
        let behind = |y: f64| farthest(&body.trunk(), y, |p| -p.z);
        let hip = prominence(0.5 * (left.buttock.y + right.buttock.y), BUTTOCK, BUTTOCK_PULL, behind);
        let bust = Side::BOTH.map(|side| bust_point(body, side).y);
        Self {
            under_arms: left.armpit.y.min(right.armpit.y) - TAPE_WIDTH,
            bust: 0.5 * (bust[0] + bust[1]),
            waist,
            top_hip: 0.5 * (waist + hip),
            hip,
        }
    }
}

/// The most forward point of a breast, or of the chest near the nipple.
pub(crate) fn bust_point(body: &Standing, side: Side) -> Point3<f64> {
    let nipple = body.side(side).nipple;
    let before = |y: f64| {
        let near = |p: &Point3<f64>| if (p.x - nipple.x).abs() < BREAST { p.z } else { f64::NEG_INFINITY };
        farthest(&body.trunk(), y, near)
    };
    let y = prominence(nipple.y, BREAST, BREAST_PULL, before);
    Point3::new(nipple.x, y, before(y))
}

/// The tape around the trunk at a level, arms left out.
pub(crate) fn around_trunk(body: &Standing, level: f64) -> Option<Tape> {
    body.trunk().girth(&Plane::level(level))
}

/// The longest of the horizontal tapes around `skin` between two levels.
pub(crate) fn longest(skin: &Skin, range: (f64, f64)) -> Option<Tape> {
    tapes(skin, range).reduce(|a, b| if b.length > a.length { b } else { a })
}

/// The shortest of the horizontal tapes around `skin` between two levels.
pub(crate) fn shortest_tape(skin: &Skin, range: (f64, f64)) -> Option<Tape> {
    tapes(skin, range).reduce(|a, b| if b.length < a.length { b } else { a })
}

fn tapes(skin: &Skin, range: (f64, f64)) -> impl Iterator<Item = Tape> {
    steps(range).filter_map(move |y| skin.girth(&Plane::level(y)))
}

/// The point of a tape that lies farthest along `score`.
pub(crate) fn farthest_of(tape: &Tape, score: impl Fn(&Point3<f64>) -> f64) -> Option<Point3<f64>> {
    tape.path.iter().copied().reduce(|a, b| if score(&b) > score(&a) { b } else { a })
}

/// The middle of two points that are one on each side.
pub(crate) fn between(points: [Point3<f64>; 2]) -> Point3<f64> {
    center(&points[0], &points[1])
}

fn steps((low, high): (f64, f64)) -> impl Iterator<Item = f64> {
    let count = ((high - low) / STEP).floor().max(0.0) as usize;
    (0..=count).map(move |k| low + k as f64 * STEP)
}

fn farthest(skin: &Skin, level: f64, score: impl Fn(&Point3<f64>) -> f64) -> f64 {
    skin.pieces(&Plane::level(level)).iter().flatten().map(score).fold(f64::NEG_INFINITY, f64::max)
}

/// The level within `reach` of `start` at which a profile stands out farthest, less `pull` times the squared distance from
/// `start`. Between the tried levels the top is that of the parabola through the best one and its neighbours.
fn prominence(start: f64, reach: f64, pull: f64, profile: impl Fn(f64) -> f64) -> f64 {
    let score = |y: f64| profile(y) - pull * (y - start).powi(2);
    let values: Vec<(f64, f64)> = steps((start - reach, start + reach)).map(|y| (y, score(y))).collect();
    let Some(best) = (0..values.len()).reduce(|a, b| if values[b].1 > values[a].1 { b } else { a }) else {
        return start;
    };
    let (y, top) = values[best];
    match (best.checked_sub(1).map(|k| values[k].1), values.get(best + 1).map(|v| v.1)) {
        (Some(below), Some(above)) if below + above < 2.0 * top => {
            y + 0.5 * STEP * (above - below) / (2.0 * top - below - above)
        }
        _ => y,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clear_prominence_is_found_and_a_flat_one_stays_at_the_templates_point() {
        let bump = |y: f64| 0.1 - 5.0 * (y - 1.013).powi(2);
        let found = prominence(1.0, 0.08, BUTTOCK_PULL, bump);
        assert!((found - 1.0 - 0.013 * 5.0 / 8.0).abs() < 1e-4, "{found}");
        assert!((prominence(1.0, 0.08, BUTTOCK_PULL, |_| 0.1) - 1.0).abs() < 1e-9);
        let (low, high) = (prominence(1.0, 0.08, 2.0, |y| 0.05 * y), prominence(1.0, 0.08, 2.0, |y| 0.06 * y));
        assert!(low < high && high < 1.02, "a slope moves it a little, without jumps: {low} {high}");
    }
}
