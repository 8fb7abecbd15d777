//! All guidance, frame by frame.

use serde::Serialize;
use toile_capture::{ColorImage, Frame, Rig};
use toile_fusion::{FusionSettings, SubjectVolume, survey};

use super::{
    exposure::Exposure,
    outline::{Dropout, Outline},
    pose::{Arms, PoseCheck},
    sides::Unseen,
    speed::Speed,
};
use crate::preview::TurnSeen;

/// Between frames that are kept until somebody is seen to move, seconds.
const KEEP_EVERY: f64 = 0.25;
/// So many of them are looked at first; then twice as many, up to the most.
const FIRST_LOOK: usize = 8;
const MOST_KEPT: usize = 32;
/// Between looks at the light, seconds.
const LIGHT_EVERY: f64 = 0.5;
/// A person is at least this far away, metres: nearer, head and feet are out of every depth camera's picture.
const NEAREST: f64 = 1.2;
/// Farther away a pixel is larger than the cloth of a hem (1.5 cm at 500 pixels of focal length).
const FARTHEST: f64 = 4.0;
/// After this long without a frame the sensor counts as silent, seconds.
const SILENT: f64 = 1.0;

/// What an operator should see and hear now.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Guidance {
    /// How far the subject has turned in this take, degrees.
    pub degrees: f64,
    /// Once round.
    pub turned: bool,
    /// How fast it turns, degrees a second.
    pub speed_deg_s: Option<f64>,
    /// The one thing to do now.
    pub advice: Option<String>,
    /// From the camera, metres.
    pub distance_m: Option<f64>,
    /// Of the subject over the ground, metres.
    pub height_m: Option<f64>,
    /// The whole subject is in the picture.
    pub in_volume: bool,
    /// How it stands.
    pub pose: PoseCheck,
    /// How it is lit.
    pub exposure: Option<Exposure>,
    /// What lacks depth.
    pub dropout: Dropout,
    /// What was not seen yet.
    pub unseen: Unseen,
    /// How the sensor is.
    pub sensor: SensorHealth,
}

/// How a sensor is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct SensorHealth {
    /// It says that it is too hot; none that is supported says so yet.
    pub hot: bool,
    /// Seconds since its last frame.
    pub silent_s: f64,
    /// Frames that it lost since it was opened.
    pub dropped: u64,
}

/// Looks at frames of the first sensor as they come.
pub struct Watch {
    rig: Rig,
    volume: Option<SubjectVolume>,
    kept: Vec<Frame>,
    next_look: usize,
    arms: Arms,
    speed: Speed,
    light_at: Option<i64>,
    last_ns: i64,
    guidance: Guidance,
    outline: Option<Outline>,
}

impl Watch {
    /// Begins to look at the first sensor of `rig`.
    pub fn new(rig: Rig) -> Self {
        Self {
            rig,
            volume: None,
            kept: Vec::new(),
            next_look: FIRST_LOOK,
            arms: Arms::default(),
            speed: Speed::default(),
            light_at: None,
            last_ns: i64::MIN,
            guidance: Guidance::default(),
            outline: None,
        }
    }

    /// A take begins: what was seen before does not count.
    pub fn begin_take(&mut self) {
        (self.speed, self.guidance.unseen) = (Speed::default(), Unseen::default());
        (self.guidance.degrees, self.guidance.turned, self.guidance.speed_deg_s) = (0.0, false, None);
    }

    /// How far the recorded take is, `seconds` after its beginning.
    pub fn turned(&mut self, seconds: f64, seen: &TurnSeen) {
        let degrees = seen.turn.angle().to_degrees();
        self.speed.push(seconds, degrees);
        (self.guidance.degrees, self.guidance.turned) = (degrees, seen.turn.is_full());
        self.guidance.speed_deg_s = self.speed.degrees_a_second();
        if let (Some(direction), Some(outline)) = (seen.turn.direction(), &self.outline) {
            self.guidance.unseen.see(direction, outline);
        }
    }

    /// Looks at a frame.
    pub fn push(&mut self, frame: &Frame, dropped: u64) {
        if frame.sensor != 0 || self.rig.sensors.is_empty() {
            return;
        }
        self.guidance.sensor = SensorHealth { hot: false, silent_s: 0.0, dropped };
        let Some(depth) = &frame.depth else { return };
        if self.volume.is_none() {
            self.look_for_somebody(frame);
        }
        let sensor = &self.rig.sensors[frame.sensor];
        let outline = self.volume.as_ref().and_then(|volume| Outline::new(sensor, depth, volume));
        self.guidance.distance_m = outline.as_ref().map(|o| o.distance_m);
        self.guidance.height_m = outline.as_ref().map(|o| o.height_m);
        self.guidance.in_volume = outline.as_ref().is_some_and(|o| o.is_whole);
        self.guidance.dropout = outline.as_ref().map(Outline::dropouts).unwrap_or_default();
        if let Some(outline) = &outline {
            self.arms.push(outline);
        }
        self.guidance.pose = self.arms.check();
        self.outline = outline;
        self.look_at_light(frame);
        self.guidance.advice = self.advice();
    }

    /// Keeps a few frames until somebody is seen to move among them.
    fn look_for_somebody(&mut self, frame: &Frame) {
        if 1e-9 * frame.device_time_ns.saturating_sub(self.last_ns) as f64 >= KEEP_EVERY {
            self.last_ns = frame.device_time_ns;
            self.kept.push(Frame { color: None, ..frame.clone() });
        }
        if self.kept.len() < self.next_look {
            return;
        }
        self.volume = survey(&self.rig, &self.kept, &FusionSettings::default()).ok();
        self.next_look = (2 * self.next_look).min(MOST_KEPT);
        if self.volume.is_some() {
            self.kept.clear();
        } else if self.kept.len() >= MOST_KEPT {
            self.kept.drain(..MOST_KEPT / 2);
        }
    }

    fn look_at_light(&mut self, frame: &Frame) {
        let is_due = self.light_at.is_none_or(|then| 1e-9 * (frame.device_time_ns - then) as f64 >= LIGHT_EVERY);
        let (Some(color), Some(outline), true) = (&frame.color, &self.outline, is_due) else { return };
        self.light_at = Some(frame.device_time_ns);
        if let Ok(picture) = ColorImage::decode(color, frame.index) {
            self.guidance.exposure = Exposure::of(&picture, &outline.is_subject);
        }
    }

    /// The most pressing advice.
    fn advice(&self) -> Option<String> {
        let now = &self.guidance;
        let Some(distance) = now.distance_m else {
            let sentence = if self.volume.is_some() { "Nobody is on the disk." } else { "Nobody turns yet." };
            return Some(sentence.into());
        };
        if distance < NEAREST {
            return Some("Too near: move the camera back.".into());
        }
        if distance > FARTHEST {
            return Some("Too far: move the camera closer.".into());
        }
        if !now.in_volume {
            return Some("The person leaves the picture: step to the middle of the disk, or move the camera.".into());
        }
        let of_speed = now.speed_deg_s.and_then(|_| {
            let sensor = self.rig.sensors.first()?;
            self.speed.advice(sensor.depth.fx, sensor.fps, distance).filter(|_| !now.turned)
        });
        let of_light = || now.exposure.as_ref().and_then(|exposure| exposure.advice.clone());
        of_speed.or_else(|| now.pose.advice.clone()).or_else(of_light)
    }

    /// What is to be shown now, `silent_s` seconds after the last frame.
    pub fn guidance(&self, silent_s: f64) -> Guidance {
        let mut guidance = self.guidance.clone();
        guidance.sensor.silent_s = silent_s;
        if silent_s > SILENT {
            guidance.advice = Some("The camera is silent: look at its cable.".into());
        }
        guidance
    }

    /// Which pixels of the last frame's depth show the subject; empty where nobody is known.
    pub fn is_subject(&self) -> &[bool] {
        self.outline.as_ref().map_or(&[], |outline| &outline.is_subject)
    }
}

#[cfg(test)]
mod tests {
    use toile_capture::Source;
    use toile_driver_synthetic::SyntheticDevice;
    use toile_synthetic::SyntheticSettings;

    use super::*;

    #[test]
    fn a_virtual_person_is_found_measured_and_told_to_turn_slower() {
        let settings = SyntheticSettings {
            frames: 40,
            degrees: 200.0,
            fps: 4.0,
            garments: Vec::new(),
            ..SyntheticSettings::default()
        };
        let mut device = SyntheticDevice::open(&settings, 0).unwrap();
        let mut watch = Watch::new(device.rig().clone());
        assert_eq!(watch.guidance(0.0).advice, None);
        while let Some(frame) = device.next_frame().unwrap() {
            watch.push(&frame, 0);
        }
        let seen = watch.guidance(0.0);
        let true_height = device.take().surface.mesh.positions.iter().map(|p| f64::from(p.y)).fold(0.0, f64::max);
        assert!((seen.distance_m.unwrap() - 2.2).abs() < 0.25, "{seen:?}");
        assert!((seen.height_m.unwrap() - true_height).abs() < 0.05, "{} {true_height}", seen.height_m.unwrap());
        assert!(seen.in_volume && seen.pose.arms_ok == Some(true) && seen.advice.is_none(), "{seen:?}");
        let exposure = seen.exposure.unwrap();
        assert!(exposure.ok && (0.1..0.9).contains(&exposure.mean), "{exposure:?}");
        assert!(seen.dropout.chest.unwrap() < 0.1, "{:?}", seen.dropout);
        let mut turn = TurnSeen::default();
        for k in 0..20 {
            turn.turn.push(&toile_geometry::Rigid::new(
                nalgebra::Vector3::new(2.2 * f64::from(k).sin(), 1.0, 2.2 * f64::from(k).cos()),
                nalgebra::Vector3::zeros(),
            ));
            watch.turned(f64::from(k) * 0.5, &turn);
        }
        let mut again = SyntheticDevice::open(&settings, 0).unwrap();
        watch.push(&again.next_frame().unwrap().unwrap(), 3);
        let seen = watch.guidance(0.0);
        assert!((seen.speed_deg_s.unwrap() - 2.0 * 57.3).abs() < 1.0 && seen.sensor.dropped == 3, "{seen:?}");
        assert!(watch.guidance(3.0).advice.unwrap().contains("silent"));
    }
}
