//! From a frame to the depth of the subject that is fused.

use toile_capture::{Frame, Rig, Sensor};
use toile_geometry::camera::PinholeCamera;

use crate::{
    FusionError,
    drop_reason::DropReason,
    frame::{CutDepth, Rectifier, drop_edges},
    settings::FusionSettings,
    subject::SubjectVolume,
    timings::Stopwatch,
};

/// A depth image has at most this many pixels: their numbers, with the border that a view adds, must be exact as floats.
const MAX_PIXELS: u64 = 16_000_000;
/// A frame that is used has at least this many measured pixels.
pub(crate) const MIN_PIXELS: usize = 500;

/// Filters the depth of one sensor and cuts the subject out.
pub(crate) struct Preparer {
    depth_scale: f32,
    filter: Filter,
    volume: Option<SubjectVolume>,
}

/// Rectification and the depth-edge filter.
pub(crate) struct Filter {
    pub rectifier: Rectifier,
    jump_slope: f64,
}

impl Filter {
    pub(crate) fn new(sensor: &Sensor, settings: &FusionSettings) -> Self {
        Self { rectifier: Rectifier::new(sensor, settings.max_depth), jump_slope: settings.jump_slope }
    }

    /// Rectified depth in metres without edges; `None` without depth or with an image of another size.
    pub(crate) fn apply(&self, frame: &Frame) -> Option<Vec<f32>> {
        let camera = &self.rectifier.camera;
        let image = frame.depth.as_ref().filter(|i| (i.width, i.height) == (camera.width, camera.height))?;
        Some(drop_edges(camera, &self.rectifier.rectify(image), self.jump_slope))
    }
}

impl Preparer {
    pub(crate) fn new(sensor: &Sensor, settings: &FusionSettings, volume: Option<SubjectVolume>) -> Self {
        Self { depth_scale: sensor.depth_scale as f32, filter: Filter::new(sensor, settings), volume }
    }

    /// The depth of the subject in a frame.
    ///
    /// # Errors
    /// Why the frame cannot be used.
    pub(crate) fn prepare(&self, frame: &Frame, clock: &mut Stopwatch) -> Result<CutDepth, DropReason> {
        let depth = clock.time("filter", || self.filter.apply(frame)).ok_or(DropReason::NoDepth)?;
        enough(clock.time("cut", || self.cut_to(&depth, self.volume.as_ref())))
    }

    /// The depth of a frame in a part of space.
    ///
    /// # Errors
    /// Why the frame cannot be used.
    pub(crate) fn cut(&self, frame: &Frame, within: Option<&SubjectVolume>) -> Result<CutDepth, DropReason> {
        let depth = self.filter.apply(frame).ok_or(DropReason::NoDepth)?;
        enough(self.cut_to(&depth, within))
    }

    /// The depth of a whole frame, metres; `None` where it has none of the sensor's size.
    pub(crate) fn filtered(&self, frame: &Frame) -> Option<Vec<f32>> {
        self.filter.apply(frame)
    }

    /// The ideal camera that the depth is seen with.
    pub(crate) fn camera(&self) -> PinholeCamera {
        self.filter.rectifier.camera
    }

    fn cut_to(&self, depth: &[f32], within: Option<&SubjectVolume>) -> CutDepth {
        let camera = &self.filter.rectifier.camera;
        match within {
            Some(volume) => CutDepth::new(camera, &volume.cut(camera, depth), self.depth_scale),
            None => CutDepth::new(camera, depth, self.depth_scale),
        }
    }
}

fn enough(cut: CutDepth) -> Result<CutDepth, DropReason> {
    let pixels = cut.count();
    if pixels < MIN_PIXELS { Err(DropReason::TooFewPixels { pixels }) } else { Ok(cut) }
}

/// A sensor of a rig that can be fused.
///
/// # Errors
/// [`FusionError::Calibration`] where there is none, or its calibration cannot be used.
pub(crate) fn usable_sensor(rig: &Rig, index: usize) -> Result<&Sensor, FusionError> {
    let wrong = |reason: &str| FusionError::Calibration { sensor: index, reason: reason.into() };
    let sensor = rig.sensors.get(index).ok_or_else(|| wrong("the source names no sensor"))?;
    if !sensor.depth.is_valid() || sensor.depth_scale.is_nan() || sensor.depth_scale <= 0.0 {
        return Err(wrong("image size, focal length or depth scale is not positive"));
    }
    if u64::from(sensor.depth.width) * u64::from(sensor.depth.height) > MAX_PIXELS {
        return Err(wrong("its depth image has more than 16 million pixels; record at a smaller size"));
    }
    Ok(sensor)
}
