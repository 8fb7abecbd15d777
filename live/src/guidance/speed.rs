//! How fast the subject turns, and how fast it may.

use std::collections::VecDeque;

/// The speed is of this time, seconds.
const WINDOW: f64 = 1.5;
/// How far hands are from the axis, metres: arms stand away from the body.
const REACH: f64 = 0.45;
/// The longest exposure of a depth camera, seconds; at lower frame rates it does not grow.
const EXPOSURE: f64 = 1.0 / 30.0;
/// Hands may smear by so many pixels.
const SMEAR: f64 = 2.0;
/// Slower than that people sway more than they turn: a turn takes two minutes.
const SLOWEST: f64 = 3.0;
/// Slower than that nobody turns.
const RESTS: f64 = 0.5;

/// The turn of late.
#[derive(Debug, Clone, Default)]
pub struct Speed(VecDeque<(f64, f64)>);

impl Speed {
    /// At `seconds` the subject has turned by `degrees` in all.
    pub fn push(&mut self, seconds: f64, degrees: f64) {
        if self.0.back().is_some_and(|last| degrees < last.1 || seconds < last.0) {
            self.0.clear();
        }
        self.0.push_back((seconds, degrees));
        while self.0.len() > 2 && self.0.get(1).is_some_and(|second| seconds - second.0 >= WINDOW) {
            self.0.pop_front();
        }
    }

    /// Degrees a second; `None` where too little was seen.
    pub fn degrees_a_second(&self) -> Option<f64> {
        let (first, last) = (self.0.front()?, self.0.back()?);
        let seconds = last.0 - first.0;
        (seconds >= 0.5 * WINDOW).then(|| (last.1 - first.1) / seconds)
    }

    /// What to do about it, for a camera with this focal length (pixels) and frame rate at this distance (metres).
    pub fn advice(&self, focal: f64, fps: f64, distance: f64) -> Option<String> {
        let speed = self.degrees_a_second()?;
        if speed < RESTS {
            return Some("Nobody turns: start the turntable.".into());
        }
        if speed > fastest(focal, fps, distance) {
            return Some("Slower.".into());
        }
        (speed < SLOWEST).then(|| "A little faster: people sway when a turn takes long.".into())
    }
}

/// The speed at which hands smear by [`SMEAR`] pixels during one exposure, degrees a second.
pub fn fastest(focal: f64, fps: f64, distance: f64) -> f64 {
    let exposure = EXPOSURE.min(1.0 / fps.max(1.0));
    let pixel = distance / focal.max(1.0);
    (SMEAR * pixel / (REACH * exposure)).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(rate: f64) -> Speed {
        let mut speed = Speed::default();
        (0..20).for_each(|k| speed.push(f64::from(k) * 0.25, rate * f64::from(k) * 0.25));
        speed
    }

    #[test]
    fn the_speed_is_that_of_late() {
        assert_eq!(Speed::default().degrees_a_second(), None);
        assert!((after(24.0).degrees_a_second().unwrap() - 24.0).abs() < 1e-9);
        let mut slowing = after(24.0);
        (1..=10).for_each(|k| slowing.push(4.75 + f64::from(k) * 0.25, 24.0 * 4.75));
        assert!(slowing.degrees_a_second().unwrap().abs() < 1e-9);
        // A new take begins at nothing.
        slowing.push(8.0, 0.0);
        assert_eq!(slowing.degrees_a_second(), None);
    }

    #[test]
    fn too_fast_too_slow_and_at_rest_are_said() {
        // A Kinect v2 at 2.2 m: 46° a second smears a hand by two pixels.
        let limit = fastest(365.0, 30.0, 2.2);
        assert!((limit - 46.0).abs() < 1.0, "{limit}");
        let said = |rate: f64| after(rate).advice(365.0, 30.0, 2.2);
        assert_eq!(said(24.0), None);
        assert!(said(60.0).unwrap().contains("Slower"));
        assert!(said(2.0).unwrap().contains("faster"));
        assert!(said(0.0).unwrap().contains("start"));
        assert_eq!(fastest(365.0, 5.0, 2.2), limit, "few frames a second are no longer exposures");
    }
}
