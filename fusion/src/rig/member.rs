//! A further sensor of the rig: its frames prepared, their times, and what it sees of the room.

use toile_capture::{Frame, Rig};
use toile_geometry::{Rigid, statistics::median};

use super::clocks::ClockMap;
use crate::{
    FusionError, FusionSettings, Volume,
    frame::{CutDepth, DepthView, depth_noise, is_measured, window_for},
    report::DroppedFrame,
    take::{Preparer, survey_sensor},
    timings::Stopwatch,
};

/// A frame whose depth is prepared.
pub(crate) struct Prepared {
    /// Without its depth.
    pub frame: Frame,
    pub depth: CutDepth,
    /// Host time, nanoseconds.
    pub time_ns: i64,
}

/// A further sensor of the rig and its frames.
pub(crate) struct Member {
    pub sensor: usize,
    pub name: String,
    pub clock: ClockMap,
    pub frames: Vec<Prepared>,
    pub dropped: Vec<DroppedFrame>,
    /// Standard deviation of the depth noise, metres.
    pub noise: f64,
    /// Half width of the averaging of normals, pixels.
    pub window: usize,
    /// Its place before the subject by its own survey, but for the turn about the axis; `None` without one.
    pub upright: Option<Rigid>,
}

impl Member {
    /// Prepares the frames of a sensor; `frames` gives each of them, with its depth.
    ///
    /// # Errors
    /// A calibration that cannot be used, or nobody who turns before the sensor.
    pub(crate) fn new(
        rig: &Rig,
        sensor: usize,
        frames: impl ExactSizeIterator<Item = Frame>,
        spread: &[Frame],
        settings: &FusionSettings,
        clock: &mut Stopwatch,
    ) -> Result<Self, FusionError> {
        let volume = match settings.volume {
            Volume::All => None,
            Volume::Auto => Some(clock.time("survey", || survey_sensor(rig, sensor, spread, settings))?),
        };
        let upright = volume.as_ref().map(|v| v.model_from_camera);
        let preparer = Preparer::new(&rig.sensors[sensor], settings, volume);
        let (mut prepared, mut dropped) = (Vec::new(), Vec::new());
        let mut times = Vec::with_capacity(frames.len());
        for mut frame in frames {
            times.push((frame.device_time_ns, frame.host_time_ns));
            let depth = preparer.prepare(&frame, clock);
            frame.depth = None;
            match depth {
                Ok(depth) => prepared.push(Prepared { frame, depth, time_ns: 0 }),
                Err(reason) => {
                    dropped.push(DroppedFrame { index: frame.index, device_time_ns: frame.device_time_ns, reason });
                }
            }
        }
        let map = ClockMap::new(&times);
        for p in &mut prepared {
            p.time_ns = map.host_ns(p.frame.device_time_ns, p.frame.host_time_ns);
        }
        let (noise, window) = noise_of(&prepared);
        let name = rig.sensors[sensor].name.clone();
        Ok(Self { sensor, name, clock: map, frames: prepared, dropped, noise, window, upright })
    }

    /// The surface elements of a frame.
    pub(crate) fn view(&self, frame: &Prepared) -> DepthView {
        frame.depth.view(self.window)
    }
}

/// The noise of some of the frames, and the averaging of normals that suits it.
fn noise_of(frames: &[Prepared]) -> (f64, usize) {
    const LOOKED_AT: usize = 3;
    let mut noises = Vec::new();
    let mut depths = Vec::new();
    for frame in frames.iter().step_by(frames.len().div_ceil(LOOKED_AT).max(1)) {
        let depth = frame.depth.meters();
        noises.extend(depth_noise(&frame.depth.camera, &depth));
        depths.extend(depth.into_iter().filter(|d| is_measured(*d)));
    }
    let noise = median(&mut noises).unwrap_or(0.0);
    let camera = frames.first().map(|f| f.depth.camera);
    let window = camera.map_or(0, |camera| window_for(&camera, noise, f64::from(median(&mut depths).unwrap_or(1.0))));
    (noise, window)
}
