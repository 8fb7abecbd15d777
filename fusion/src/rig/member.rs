//! A further sensor of the rig: its frames, their times, and their depth cut to the subject from where it stands.

use rayon::prelude::*;
use toile_capture::{Frame, Rig};
use toile_geometry::{Rigid, camera::PinholeCamera};

use super::{clocks::ClockMap, path::Path, sighting::Look};
use crate::{
    FusionError, FusionSettings, Volume,
    drop_reason::DropReason,
    frame::{CutDepth, depth_noise, window_for},
    report::DroppedFrame,
    subject::SubjectVolume,
    take::{Preparer, Waiting, spread, survey_sensor},
};

/// Half width of the averaging of normals before the noise is known, pixels.
const FIRST_WINDOW: usize = 4;

/// A further sensor of the rig and its frames.
pub(crate) struct Member {
    pub sensor: usize,
    pub name: String,
    pub clock: ClockMap,
    frames: Vec<Waiting>,
    preparer: Preparer,
    /// Standard deviation of the depth noise, metres.
    pub noise: f64,
    /// Half width of the averaging of normals, pixels.
    pub window: usize,
}

impl Member {
    pub(crate) fn new(rig: &Rig, sensor: usize, frames: Vec<Waiting>, settings: &FusionSettings) -> Self {
        let times: Vec<(i64, i64)> = frames.iter().map(Waiting::times).collect();
        Self {
            sensor,
            name: rig.sensors[sensor].name.clone(),
            clock: ClockMap::new(&times),
            frames,
            preparer: Preparer::new(&rig.sensors[sensor], settings, None),
            noise: 0.0,
            window: FIRST_WINDOW,
        }
    }

    /// Number of frames.
    pub(crate) fn len(&self) -> usize {
        self.frames.len()
    }

    /// True where a frame has depth.
    pub(crate) fn has_depth(&self, index: usize) -> bool {
        self.frames[index].has_depth()
    }

    /// A frame; its depth may be packed.
    pub(crate) fn frame(&self, index: usize) -> &Frame {
        &self.frames[index].frame
    }

    /// Host time of a frame, nanoseconds.
    pub(crate) fn time_ns(&self, index: usize) -> i64 {
        let (device, host) = self.frames[index].times();
        self.clock.host_ns(device, host)
    }

    /// The depth of a frame in a part of space.
    ///
    /// # Errors
    /// Why the frame cannot be used.
    pub(crate) fn depth(&self, index: usize, within: Option<&SubjectVolume>) -> Result<CutDepth, DropReason> {
        self.preparer.cut(&self.frames[index].unpacked(), within)
    }

    /// The filtered depth (metres, 0 missing) of frames spread over the take.
    pub(crate) fn filtered(&self) -> Vec<Vec<f32>> {
        spread(&self.frames).iter().filter_map(|frame| self.preparer.filtered(frame)).collect()
    }

    /// The ideal camera that the depth is seen with.
    pub(crate) fn camera(&self) -> PinholeCamera {
        self.preparer.camera()
    }

    /// Some frames cut to a part of space, and how the disk stood then.
    pub(crate) fn looks(&self, frames: &[usize], path: &Path, within: Option<&SubjectVolume>) -> Vec<Look> {
        let look = |&i: &usize| {
            let depth = self.depth(i, within).ok()?;
            Some(Look { view: depth.view(self.window), turn: path.at(self.time_ns(i)) })
        };
        frames.par_iter().filter_map(look).collect()
    }

    /// Takes noise and the averaging of normals from a frame.
    pub(crate) fn adapt(&mut self, depth: &CutDepth) {
        let meters = depth.meters();
        self.noise = depth_noise(&depth.camera, &meters).unwrap_or(0.0);
        let mean = meters.iter().map(|d| f64::from(*d)).sum::<f64>() / depth.count().max(1) as f64;
        self.window = window_for(&depth.camera, self.noise, mean);
    }

    /// The subject's volume as the sensor's own frames show it.
    ///
    /// # Errors
    /// Nobody who turns before the sensor.
    pub(crate) fn survey(&self, rig: &Rig, settings: &FusionSettings) -> Result<Option<SubjectVolume>, FusionError> {
        match settings.volume {
            Volume::All => Ok(None),
            Volume::Auto => survey_sensor(rig, self.sensor, &spread(&self.frames), settings).map(Some),
        }
    }

    /// A frame that is left out.
    pub(crate) fn dropped(&self, index: usize, reason: DropReason) -> DroppedFrame {
        let frame = self.frame(index);
        DroppedFrame { index: frame.index, device_time_ns: frame.device_time_ns, reason }
    }
}

/// The part of space around the subject for a camera at a place of the room, from `raised` metres over the floor on.
pub(crate) fn volume_at(volume: Option<&SubjectVolume>, place: &Rigid, raised: f64) -> Option<SubjectVolume> {
    let volume = volume?;
    let bottom = volume.bottom.map(|bottom| bottom + raised);
    Some(SubjectVolume { model_from_camera: *place, bottom, ..volume.clone() })
}
