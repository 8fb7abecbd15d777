//! How disk and person move while a take is recorded.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use toile_geometry::Rigid;

use crate::{random::Random, settings::SyntheticSettings};

/// Device time of the first frame, nanoseconds.
const FIRST_TIME_NS: i64 = 1_000_000_000;
/// Standard deviation of the time between frames, seconds.
const TIME_JITTER_S: f64 = 0.0025;
/// How much the disk's rate varies slowly, and from frame to frame, as shares.
const RATE: (f64, f64) = (0.04, 0.02);

/// One moment of a take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Device time, nanoseconds.
    pub time_ns: i64,
    /// How far the disk has turned since the first frame, radians around +Y.
    pub angle: f64,
    /// Forward tilt of the torso, radians.
    pub pitch: f64,
    /// Sideways tilt of the torso, radians.
    pub roll: f64,
    /// How far the chest stands out, metres.
    pub breath: f64,
}

impl Moment {
    /// Where the standing camera is for someone who turns with the disk.
    pub fn subject_from_camera(&self, room_from_camera: &Rigid) -> Rigid {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * -self.angle);
        Rigid::from_parts(Translation3::identity(), turn) * room_from_camera
    }
}

/// The moments of a take's frames.
pub fn moments(settings: &SyntheticSettings, take: usize) -> Vec<Moment> {
    let mut random = Random::new(settings.seed, &format!("take {take} motion"));
    let phases: [f64; 6] = std::array::from_fn(|_| random.range(0.0, std::f64::consts::TAU));
    let (rate, jitter) = RATE;
    let steps: Vec<f64> = (1..settings.frames)
        .map(|i| {
            let t = std::f64::consts::TAU * i as f64 / settings.frames as f64;
            1.0 + rate * (0.6 * (t + phases[0]).sin() + 0.4 * (3.0 * t + phases[1]).sin()) + jitter * random.normal(2.0)
        })
        .collect();
    let unit = settings.degrees.to_radians() / steps.iter().sum::<f64>().max(1e-9);
    let sway = settings.sway_degrees.to_radians();
    let mut moment = Moment { time_ns: FIRST_TIME_NS, angle: 0.0, pitch: 0.0, roll: 0.0, breath: 0.0 };
    let mut moments = Vec::with_capacity(settings.frames);
    for i in 0..settings.frames {
        if i > 0 {
            let wait = 1.0 / settings.fps + TIME_JITTER_S.min(0.1 / settings.fps) * random.normal(2.0);
            moment.time_ns += (wait * 1e9) as i64;
            moment.angle += unit * steps[i - 1];
        }
        let s = (moment.time_ns - FIRST_TIME_NS) as f64 * 1e-9;
        let wave = |period: f64, phase: f64| (std::f64::consts::TAU * s / period + phase).sin();
        moment.pitch = sway * (0.65 * wave(9.3, phases[2]) + 0.35 * wave(4.1, phases[3]));
        moment.roll = sway * (0.65 * wave(7.7, phases[4]) + 0.35 * wave(3.6, phases[5]));
        moment.breath = settings.breathing_m * wave(3.8, phases[1]);
        moments.push(moment);
    }
    moments
}

/// How sway and breath bend a body of known height: nothing below the hips, everything above the waist.
#[derive(Debug, Clone, Copy)]
pub struct Bend {
    /// Where the torso tilts, in the subject's frame.
    pub hips: Point3<f64>,
    /// Where the chest swells.
    pub chest: Point3<f64>,
}

impl Bend {
    /// Moves points of the true surface to where they are at `moment`.
    pub fn apply(&self, points: &[Point3<f32>], moment: &Moment) -> Vec<Point3<f32>> {
        if moment.pitch == 0.0 && moment.roll == 0.0 && moment.breath == 0.0 {
            return points.to_vec();
        }
        points.iter().map(|p| self.moved(&p.cast(), moment).cast()).collect()
    }

    fn moved(&self, p: &Point3<f64>, moment: &Moment) -> Point3<f64> {
        /// Over this height around the hips the tilt sets in, metres.
        const TRANSITION: f64 = 0.3;
        /// Height of the breathing part of the chest (standard deviation), metres.
        const CHEST: f64 = 0.12;
        let t = ((p.y - self.hips.y) / TRANSITION + 0.5).clamp(0.0, 1.0);
        let share = t * t * (3.0 - 2.0 * t);
        let tilt = Vector3::new(moment.pitch, 0.0, moment.roll) * share;
        let pivot = Translation3::from(self.hips.coords);
        let turned = (pivot * Isometry3::rotation(tilt) * pivot.inverse()) * p;
        let from_chest = turned - self.chest;
        let near_axis = (-(from_chest.x / 0.2).powi(4)).exp();
        let swell = (-0.5 * (from_chest.y / CHEST).powi(2)).exp() * near_axis * moment.breath;
        let outward = Vector3::new(from_chest.x, 0.0, from_chest.z).try_normalize(1e-6).unwrap_or_default();
        turned + outward * swell
    }
}
