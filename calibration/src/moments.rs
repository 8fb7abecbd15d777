//! Views of one moment from cameras that nobody synchronised: corners between two pictures are interpolated.

use crate::{board::Corner, rig::View};

/// Moments that are used of each camera's pictures at most, evenly over the recording.
const MOST: usize = 30;
/// Two pictures of a camera between which corners are interpolated are at most this far apart, nanoseconds.
const APART_NS: i64 = 250_000_000;
/// And their corners at most this far, pixels: a board that is held still moves less; one that is waved does not move evenly.
const MOVED: f64 = 6.0;

/// The board in one picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Sighting {
    /// Which camera.
    pub camera: usize,
    /// When, by a clock that all cameras have in common, nanoseconds.
    pub time_ns: i64,
    /// The board's corners that are seen, by their numbers.
    pub corners: Vec<Corner>,
}

/// Views of the same moments. Pictures in which the board moves fast are left out.
pub fn views_of(sightings: &[Sighting], cameras: usize) -> Vec<View> {
    let of = |camera: usize| -> Vec<&Sighting> {
        let mut all: Vec<&Sighting> = sightings.iter().filter(|s| s.camera == camera).collect();
        all.sort_by_key(|s| s.time_ns);
        all
    };
    let by_camera: Vec<Vec<&Sighting>> = (0..cameras).map(of).collect();
    let mut views = Vec::new();
    let mut moment = 0;
    for (camera, own) in by_camera.iter().enumerate() {
        let still: Vec<&&Sighting> = own.iter().filter(|s| corners_at(own, s.time_ns).is_some()).collect();
        for sighting in still.iter().step_by(still.len().div_ceil(MOST).max(1)) {
            views.push(View { camera, moment, corners: sighting.corners.clone() });
            for (other, seen) in by_camera.iter().enumerate().filter(|(other, _)| *other != camera) {
                if let Some(corners) = corners_at(seen, sighting.time_ns) {
                    views.push(View { camera: other, moment, corners });
                }
            }
            moment += 1;
        }
    }
    views
}

/// A camera's corners at a time that were seen before and after it, where the board moved little.
fn corners_at(seen: &[&Sighting], time_ns: i64) -> Option<Vec<Corner>> {
    let after = seen.partition_point(|s| s.time_ns < time_ns).clamp(1, seen.len().max(2) - 1);
    let (a, b) = (seen.get(after - 1)?, seen.get(after)?);
    let span = b.time_ns - a.time_ns;
    let share = (time_ns - a.time_ns) as f64 / span.max(1) as f64;
    let after = |corner: &Corner| {
        let found = b.corners.binary_search_by_key(&corner.id, |c| c.id).ok()?;
        Some((*corner, b.corners[found].at - corner.at))
    };
    let ways: Vec<_> = a.corners.iter().filter_map(after).collect();
    let moved = ways.iter().map(|(_, way)| way.norm()).fold(0.0, f64::max);
    let is_between = (-0.01..=1.01).contains(&share) && span <= APART_NS && moved <= MOVED && !ways.is_empty();
    is_between.then(|| ways.iter().map(|(corner, way)| Corner { at: corner.at + way * share, ..*corner }).collect())
}

#[cfg(test)]
mod tests {
    use nalgebra::Point2;

    use super::*;

    fn sighting(camera: usize, time_ms: i64, x: f64) -> Sighting {
        Sighting { camera, time_ns: time_ms * 1_000_000, corners: Corner::all(vec![Point2::new(x, 2.0 * x)]) }
    }

    #[test]
    fn corners_between_two_pictures_are_interpolated_and_fast_boards_left_out() {
        let slow = [sighting(0, 0, 0.0), sighting(0, 100, 1.0), sighting(1, 40, 5.0), sighting(1, 140, 6.0)];
        let views = views_of(&slow, 2);
        let at = |camera: usize, moment: usize| {
            views.iter().find(|v| v.camera == camera && v.moment == moment).map(|v| v.corners[0].at.x)
        };
        // Camera 0 at 100 ms sees what camera 1 saw between 40 and 140 ms; camera 1 at 40 ms what camera 0 saw before.
        assert_eq!((at(0, 1), at(1, 1)), (Some(1.0), Some(5.6)));
        assert_eq!((at(1, 2), at(0, 2)), (Some(5.0), Some(0.4)));
        assert!(views_of(&[sighting(0, 0, 0.0), sighting(0, 100, 20.0)], 1).is_empty());
        assert!(views_of(&[sighting(0, 0, 0.0)], 1).is_empty());
        // Another part of a board that is not wholly seen: only what both pictures show is in between.
        let mut part = [sighting(0, 0, 0.0), sighting(0, 100, 1.0)];
        part[0].corners.push(Corner { id: 7, at: Point2::new(3.0, 3.0) });
        part[1].corners.push(Corner { id: 9, at: Point2::new(90.0, 3.0) });
        assert_eq!(views_of(&part, 1).last().unwrap().corners.len(), 2, "its own");
        let between = corners_at(&part.iter().collect::<Vec<_>>(), 50_000_000).unwrap();
        assert_eq!(between, [Corner { id: 0, at: Point2::new(0.5, 1.0) }]);
    }
}
