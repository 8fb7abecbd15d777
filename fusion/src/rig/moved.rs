//! A camera that was pushed aside within a take: the places that its frames give jump.

use nalgebra::Vector6;
use toile_geometry::Rigid;

use super::place::{Subject, apart};

/// Frames on either side of a push at least.
const LEAST: usize = 6;
/// A push that matters, metres at the subject: stands on a firm floor keep still to less.
const JUMP: f64 = 0.004;
/// And it is this many times what the means of as many frames before and after any moment usually differ by: people sway,
/// and the places that their frames give with them, but slowly.
const SIGNIFICANT: f64 = 5.0;
/// Turns are weighed by this lever, metres.
const LEVER: f64 = 0.5;

/// A push.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Push {
    /// The first place after it, by index.
    pub at: usize,
    /// How far the camera was moved, metres, and turned, degrees.
    pub moved: (f64, f64),
}

/// The push that the places (in the order of time) show; `None` where the camera rested.
pub(crate) fn find_push(places: &[Rigid], subject: &Subject) -> Option<Push> {
    let reference = subject.mean(places)?;
    let series: Vec<Vector6<f64>> = places.iter().map(|p| weighed(subject.step(&reference, p))).collect();
    let mean = |part: &[Vector6<f64>]| part.iter().sum::<Vector6<f64>>() / part.len() as f64;
    let splits = || LEAST..places.len().saturating_sub(LEAST) + 1;
    let near = |at: usize| (mean(&series[at..at + LEAST]) - mean(&series[at - LEAST..at])).norm();
    let usual = toile_geometry::statistics::median(&mut splits().map(near).collect::<Vec<f64>>())?;
    let at = splits().max_by(|a, b| near(*a).total_cmp(&near(*b)))?;
    let lasting = (mean(&series[at..]) - mean(&series[..at])).norm();
    if near(at).min(2.0 * lasting) < JUMP || near(at) < SIGNIFICANT * usual {
        return None;
    }
    let moved = apart(&subject.mean(&places[..at])?, &subject.mean(&places[at..])?);
    Some(Push { at, moved })
}

/// A step with its turn as the way at a lever.
fn weighed(mut step: Vector6<f64>) -> Vector6<f64> {
    step.fixed_rows_mut::<3>(0).iter_mut().for_each(|turn| *turn *= LEVER);
    step
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector3};

    use super::*;

    #[test]
    fn a_push_is_found_where_it_was_and_none_where_there_was_none() {
        let subject = Subject { center: Point3::new(0.0, 0.9, 0.0) };
        let still = Rigid::new(Vector3::new(0.0, 1.0, 2.2), Vector3::new(3.1, 0.0, 0.0));
        let place = |k: usize, push: f64| {
            let at = |j: usize| ((k * 6 + j) as f64 * 2.399).sin() * 0.0015;
            let noise = Rigid::new(Vector3::new(at(0), at(1), at(2)), Vector3::new(at(3), at(4), at(5)) * 0.5);
            noise * still * Rigid::new(Vector3::x() * push, Vector3::y() * push)
        };
        let places: Vec<Rigid> = (0..80).map(|k| place(k, if k < 50 { 0.0 } else { 0.01 })).collect();
        let push = find_push(&places, &subject).unwrap();
        assert_eq!(push.at, 50);
        assert!((push.moved.0 - 0.01).abs() < 0.003 && (push.moved.1 - 0.573).abs() < 0.1, "{push:?}");
        assert_eq!(find_push(&(0..80).map(|k| place(k, 0.0)).collect::<Vec<_>>(), &subject), None);
        assert_eq!(find_push(&[still; 3], &subject), None);
    }
}
