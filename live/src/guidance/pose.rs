//! The pose check: are the arms away from the body, so that the scan shows what lies between.

use std::collections::VecDeque;

use serde::Serialize;

use super::outline::Outline;

/// Outlines that are remembered: at thirty a second the last fifteen seconds, which is a turn.
const REMEMBERED: usize = 450;
/// Arms can be told from the side only where the shoulders are seen at this share of their greatest width or more: 37° around
/// the front and the back.
const FRONTAL: f64 = 0.8;
/// Before so many such outlines nothing is said.
const ENOUGH: usize = 5;
/// Between hip and chest an arm that hangs free is a piece of its own; empty columns of 2 cm that part it from the trunk. A
/// voxel of the scan is 4 mm, and flying pixels fill a gap of up to a pixel (6 mm) from either side.
const GAP: usize = 2;
const BAND: (f64, f64) = (0.50, 0.72);
/// Rows of 2 cm in which both arms are pieces of their own: as much as a hand is wide. In an A-pose the arms cross only a
/// part of the band.
const LEAST_FREE: usize = 4;

/// Whether the person stands as the scan needs it.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct PoseCheck {
    /// Arms stand away from the body; `None` while they were not seen from the front or back.
    pub arms_ok: Option<bool>,
    /// What to say to the person.
    pub advice: Option<String>,
}

/// What was seen of the arms of late.
#[derive(Debug, Clone, Default)]
pub struct Arms(VecDeque<(f64, bool)>);

impl Arms {
    /// Takes one outline.
    pub fn push(&mut self, outline: &Outline) {
        let width = |row| outline.extent(row).map_or(0, |(first, last)| last + 1 - first);
        let shoulders = outline.rows(0.74, 0.84).map(width).max().unwrap_or(0) as f64;
        let free = outline.rows(BAND.0, BAND.1).filter(|row| outline.pieces(*row, GAP) >= 3).count();
        if self.0.len() >= REMEMBERED {
            self.0.pop_front();
        }
        self.0.push_back((shoulders, free >= LEAST_FREE));
    }

    /// What follows for the pose.
    pub fn check(&self) -> PoseCheck {
        let widest = self.0.iter().map(|seen| seen.0).fold(0.0, f64::max);
        let frontal: Vec<bool> = self.0.iter().filter(|seen| seen.0 >= FRONTAL * widest).map(|seen| seen.1).collect();
        if frontal.len() < ENOUGH {
            return PoseCheck::default();
        }
        let free = frontal.iter().filter(|is_free| **is_free).count();
        let arms_ok = 2 * free > frontal.len();
        let advice = (!arms_ok).then(|| "Arms away from the body, as far as a hand is wide.".to_string());
        PoseCheck { arms_ok: Some(arms_ok), advice }
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::outline::drawn::{boxes, sensor, volume},
        *,
    };

    /// A trunk on two legs, and arms that leave a gap of this many metres.
    fn person(gap: f64) -> Outline {
        let arm = 0.16 + gap;
        let parts = [
            [-0.16, 0.16, 0.78, 1.7],
            [-0.14, -0.03, 0.0, 0.8],
            [0.03, 0.14, 0.0, 0.8],
            [arm, arm + 0.08, 0.75, 1.3],
            [-arm - 0.08, -arm, 0.75, 1.3],
            [-arm - 0.08, arm + 0.08, 1.28, 1.42],
        ];
        Outline::new(&sensor(), &boxes(&parts), &volume()).unwrap()
    }

    #[test]
    fn arms_on_the_body_are_noticed_and_arms_away_from_it_are_fine() {
        for (gap, ok) in [(0.15, true), (0.08, true), (0.0, false)] {
            let mut arms = Arms::default();
            assert_eq!(arms.check(), PoseCheck::default());
            (0..ENOUGH).for_each(|_| arms.push(&person(gap)));
            let check = arms.check();
            assert_eq!((check.arms_ok, check.advice.is_some()), (Some(ok), !ok), "{gap}");
        }
    }

    #[test]
    fn who_stands_sideways_is_not_judged() {
        let side = Outline::new(&sensor(), &boxes(&[[-0.12, 0.12, 0.0, 1.7]]), &volume()).unwrap();
        let mut arms = Arms::default();
        (0..ENOUGH).for_each(|_| arms.push(&person(0.12)));
        (0..100).for_each(|_| arms.push(&side));
        assert_eq!(arms.check().arms_ok, Some(true));
    }
}
