//! How far the subject has turned, and which sides were not seen yet.

use std::f64::consts::{PI, TAU};

use toile_geometry::Rigid;

/// Directions that a subject is looked at from, at every 45° to its left.
const SIDES: [&str; 8] =
    ["front", "front left", "left side", "back left", "back", "back right", "right side", "front right"];
/// A turn is full when it comes this far beyond the beginning, radians (3°): the ends overlap.
const OVERLAP: f64 = 0.05;
/// Parts that the circle is counted in.
const PARTS: usize = 72;

/// Where the camera has been around the subject.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Turn {
    /// Direction of the last pose, and of all turned together, radians.
    last: Option<(f64, f64)>,
    /// Added to directions in the present scan frame.
    offset: f64,
    anew: bool,
    seen: Vec<bool>,
}

impl Turn {
    /// Takes the camera's pose in the scan frame (+Y up, +Z towards the camera at the first frame).
    pub fn push(&mut self, scan_from_camera: &Rigid) {
        if std::mem::take(&mut self.anew)
            && let Some((before, _)) = self.last
        {
            self.offset = before - azimuth(scan_from_camera);
        }
        let direction = azimuth(scan_from_camera) + self.offset;
        let (before, turned) = self.last.unwrap_or((direction, 0.0));
        let step = (direction - before + PI).rem_euclid(TAU) - PI;
        self.last = Some((direction, turned + step));
        self.mark(direction);
    }

    /// Another camera of the rig saw the subject at the same time.
    pub fn also_seen_from(&mut self, scan_from_camera: &Rigid) {
        self.mark(azimuth(scan_from_camera) + self.offset);
    }

    /// From now on poses are those of another camera, which stood here at the last pose, and in another scan frame.
    pub fn follow_another(&mut self, scan_from_camera: &Rigid) {
        let direction = azimuth(scan_from_camera) + self.offset;
        self.last = self.last.map(|(_, turned)| (direction, turned));
        self.start_anew();
    }

    fn mark(&mut self, direction: f64) {
        self.seen.resize(PARTS, false);
        // What a frame shows, it shows well 15° to either side.
        let reach = PARTS / 24;
        let part = (direction.rem_euclid(TAU) / TAU * PARTS as f64) as usize;
        (0..=2 * reach).for_each(|k| self.seen[(part + PARTS + k - reach) % PARTS] = true);
    }

    /// The next pose is in another scan frame: it goes on where the last one ended.
    pub fn start_anew(&mut self) {
        self.anew = true;
    }

    /// How far it has turned, radians, either way.
    pub fn angle(&self) -> f64 {
        self.last.map_or(0.0, |(_, turned)| turned.abs())
    }

    /// Where the camera stands now about the subject: radians about +Y, 0 where it stood at the first frame.
    pub fn direction(&self) -> Option<f64> {
        self.last.map(|(direction, _)| direction)
    }

    /// True after one full turn.
    pub fn is_full(&self) -> bool {
        self.angle() >= TAU + OVERLAP
    }

    /// True where the turn came round as far as the preview can measure it: within 5°.
    pub fn came_round(&self) -> bool {
        self.angle() >= TAU - 0.09
    }

    /// Sides that were not seen yet, in words.
    pub fn unseen(&self) -> Vec<&'static str> {
        if self.seen.is_empty() {
            return SIDES.to_vec();
        }
        let part = |side: usize| self.seen[side * PARTS / SIDES.len()];
        SIDES.into_iter().enumerate().filter(|(side, _)| !part(*side)).map(|(_, name)| name).collect()
    }
}

/// Direction from the axis to a camera, about +Y from +Z.
fn azimuth(scan_from_camera: &Rigid) -> f64 {
    let place = scan_from_camera.translation.vector;
    place.x.atan2(place.z)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    fn at(degrees: f64) -> Rigid {
        Rigid::rotation(Vector3::y() * degrees.to_radians()) * Rigid::translation(0.0, 1.0, 2.5)
    }

    #[test]
    fn a_turn_either_way_is_full_only_with_some_overlap() {
        for way in [1.0, -1.0] {
            let mut turn = Turn::default();
            (0..=90).for_each(|i| turn.push(&at(way * f64::from(i) * 4.0)));
            assert!((turn.angle().to_degrees() - 360.0).abs() < 1e-6 && !turn.is_full());
            turn.push(&at(way * 364.0));
            assert!(turn.is_full() && turn.unseen().is_empty());
        }
    }

    #[test]
    fn sides_that_the_camera_did_not_pass_are_named() {
        let mut turn = Turn::default();
        assert_eq!(turn.unseen().len(), 8);
        (0..=45).for_each(|i| turn.push(&at(f64::from(i) * 4.0)));
        assert_eq!(turn.unseen(), ["back right", "right side", "front right"]);
        // Poses of another scan frame go on where the turn was.
        let mut anew = turn.clone();
        anew.start_anew();
        (0..=30).for_each(|i| anew.push(&at(f64::from(i) * 4.0)));
        assert!((anew.angle().to_degrees() - 300.0).abs() < 1e-6);
        assert_eq!(anew.unseen(), ["front right"]);
        // Another camera stands a quarter of a turn ahead, and then takes over with a scan frame of its own.
        let mut other = turn.clone();
        other.also_seen_from(&at(270.0));
        assert_eq!(other.unseen(), ["back right", "front right"]);
        other.follow_another(&at(270.0));
        (0..=15).for_each(|i| other.push(&at(f64::from(i) * 4.0)));
        assert!((other.angle().to_degrees() - 240.0).abs() < 1e-6);
        assert_eq!(other.unseen(), ["back right"]);
        // Back and forth is not a turn.
        (0..=45).rev().for_each(|i| turn.push(&at(f64::from(i) * 4.0)));
        assert!(turn.angle() < 1e-9);
    }
}
