//! How disk and person move while a take is recorded.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use toile_geometry::Rigid;

use crate::{
    random::Random,
    rig::{Stand, direction},
    settings::SyntheticSettings,
};

/// Device time of the first frame, nanoseconds.
const FIRST_TIME_NS: i64 = 1_000_000_000;
/// Host time minus device time of the virtual device, nanoseconds.
const LATENCY_NS: i64 = 8_000_000;
/// Standard deviation of the time between frames, seconds.
const TIME_JITTER_S: f64 = 0.0025;
/// How much the disk's rate varies slowly, and from frame to frame, as shares.
const RATE: (f64, f64) = (0.04, 0.02);

/// Largest delay of a frame's arrival in a rig, beyond the shortest one, seconds.
const ARRIVAL_JITTER_S: f64 = 0.004;

/// One moment of a take: the exposure of one sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Which sensor of the rig looks.
    pub sensor: usize,
    /// Device time by the sensor's own clock, nanoseconds.
    pub time_ns: i64,
    /// Host time of the frame's arrival, nanoseconds.
    pub host_time_ns: i64,
    /// How far the disk has turned since the first frame, radians around +Y.
    pub angle: f64,
    /// Forward tilt of the torso, radians.
    pub pitch: f64,
    /// Sideways tilt of the torso, radians.
    pub roll: f64,
    /// How far the chest stands out, metres.
    pub breath: f64,
    /// How the sensor is turned by its shaking, in its own frame, axis times angle, radians.
    pub shake: Vector3<f64>,
    /// True from when the sensor has been pushed aside on.
    pub is_knocked: bool,
}

impl Moment {
    /// Where the standing camera is for someone who turns with the disk.
    pub fn subject_from_camera(&self, room_from_camera: &Rigid) -> Rigid {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * -self.angle);
        Rigid::from_parts(Translation3::identity(), turn) * room_from_camera
    }
}

/// When the first sensor looks: seconds since its first frame, and how far the disk has turned, radians.
#[derive(Clone, Copy)]
struct Exposure {
    time_ns: i64,
    angle: f64,
}

/// The moments of a take's frames, in the order of time.
pub(crate) fn moments(settings: &SyntheticSettings, take: usize, stands: &[Stand]) -> Vec<Moment> {
    let mut random = Random::new(settings.seed, &format!("take {take} motion"));
    let phases: [f64; 6] = std::array::from_fn(|_| random.range(0.0, std::f64::consts::TAU));
    let exposures = exposures(settings, &phases, &mut random);
    let period_ns = 1e9 / settings.fps;
    let mut moments = Vec::with_capacity(exposures.len() * stands.len());
    for i in 0..exposures.len() {
        for (k, stand) in stands.iter().enumerate() {
            // Cameras that nobody synchronises are exposed one after the other, never quite evenly.
            let mut random = Random::new(settings.seed, &format!("take {take} camera {k} frame {i}"));
            let phase = (k as f64 / stands.len() as f64 * period_ns) as i64;
            let true_ns = exposures[i].time_ns - FIRST_TIME_NS + phase;
            let delay = if stands.len() > 1 { random.range(0.0, ARRIVAL_JITTER_S) } else { 0.0 };
            let mut moment = Moment {
                sensor: k,
                time_ns: FIRST_TIME_NS + stand.clock.0 + (true_ns as f64 * stand.clock.1) as i64,
                host_time_ns: FIRST_TIME_NS + true_ns + LATENCY_NS + (delay * 1e9) as i64,
                angle: angle_at(&exposures, i, phase),
                pitch: 0.0,
                roll: 0.0,
                breath: 0.0,
                shake: direction(&mut random) * settings.rig.shake_degrees.to_radians() * random.normal(3.0),
                is_knocked: settings.rig.knock_m > 0.0 && k + 1 == stands.len() && 2 * i >= exposures.len(),
            };
            bend(&mut moment, settings, true_ns as f64 * 1e-9, &phases);
            moments.push(moment);
        }
    }
    moments
}

/// How far the disk has turned `phase` nanoseconds after exposure `i`: even between two exposures.
fn angle_at(exposures: &[Exposure], i: usize, phase: i64) -> f64 {
    let first = i.min(exposures.len().saturating_sub(2));
    let (a, b) = (exposures[first], exposures[(first + 1).min(exposures.len() - 1)]);
    let rate = (b.angle - a.angle) / ((b.time_ns - a.time_ns).max(1) as f64);
    exposures[i].angle + rate * phase as f64
}

/// When the first sensor looks, and how far the disk has turned then.
fn exposures(settings: &SyntheticSettings, phases: &[f64; 6], random: &mut Random) -> Vec<Exposure> {
    let (rate, jitter) = RATE;
    let last = settings.frames.saturating_sub(1).max(1) as f64;
    let steps: Vec<f64> = (1..settings.frames)
        .map(|i| {
            let t = std::f64::consts::TAU * i as f64 / settings.frames as f64;
            let even = 1.0
                + rate * (0.6 * (t + phases[0]).sin() + 0.4 * (3.0 * t + phases[1]).sin())
                + jitter * random.normal(2.0);
            even * settings.motion.rate((i as f64 - 0.5) / last)
        })
        .collect();
    let way = steps.iter().map(|s| s.abs()).sum::<f64>().max(1e-9);
    let unit = settings.motion.ways() * settings.degrees.to_radians() / way;
    let mut exposure = Exposure { time_ns: FIRST_TIME_NS, angle: 0.0 };
    let mut all = vec![exposure];
    for step in steps {
        let wait = 1.0 / settings.fps + TIME_JITTER_S.min(0.1 / settings.fps) * random.normal(2.0);
        exposure.time_ns += (wait * 1e9) as i64;
        exposure.angle += unit * step;
        all.push(exposure);
    }
    all
}

/// Sway and breath `s` seconds after the take began.
fn bend(moment: &mut Moment, settings: &SyntheticSettings, s: f64, phases: &[f64; 6]) {
    let sway = settings.sway_degrees.to_radians();
    let wave = |period: f64, phase: f64| (std::f64::consts::TAU * s / period + phase).sin();
    moment.pitch = sway * (0.65 * wave(9.3, phases[2]) + 0.35 * wave(4.1, phases[3]));
    moment.roll = sway * (0.65 * wave(7.7, phases[4]) + 0.35 * wave(3.6, phases[5]));
    moment.breath = settings.breathing_m * wave(3.8, phases[1]);
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
