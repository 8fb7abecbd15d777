//! A depth camera with the colour of another camera beside it, paired by time.

use std::collections::VecDeque;

use toile_capture::{CaptureError, ClockDomain, ColorImage, Frame, Rig, Sensor, Source};

use crate::{ColorCalibration, WebcamError, feed::Feed, nearest::Nearest};

/// Frames a second of a source that does not say its rate.
const USUAL_FPS: f64 = 30.0;

/// A depth camera whose frames have the colour of a camera beside it: of its pictures, the one that is nearest in host time.
///
/// Depth keeps its own clock, numbers and losses. A frame for which there is no picture within half the time between
/// frames (of the slower camera) is given without colour. A webcam that fails is reported once; depth goes on alone.
pub struct ColorBeside {
    depth: Box<dyn Source>,
    color: Feed,
    rig: Rig,
    nearest: Nearest<Frame, ColorImage>,
    /// Errors of either camera, reported after the frames that came before them.
    failed: VecDeque<CaptureError>,
    depth_ended: bool,
}

impl ColorBeside {
    /// Puts the colour of `color`'s first sensor beside the depth of `depth`'s only one. Where both are `live` the colour is
    /// read by a thread of its own, so that neither holds the other up; recordings are read as they are asked for, the
    /// same in every run.
    ///
    /// # Errors
    /// [`WebcamError::Beside`] where `depth` has several sensors, or the calibration is not of the pictures' size.
    pub fn new(
        depth: Box<dyn Source>,
        color: Box<dyn Source>,
        calibration: &ColorCalibration,
        is_live: bool,
    ) -> Result<Self, WebcamError> {
        let mut rig = depth.rig().clone();
        let [sensor] = &mut rig.sensors[..] else {
            let count = rig.sensors.len();
            let reason = format!("the depth camera has {count} sensors; put colour beside a camera with one");
            return Err(WebcamError::Beside(reason));
        };
        let pictures = color.rig().sensors.first().filter(|sensor| sensor.color.is_some());
        let pictures = pictures.ok_or_else(|| WebcamError::Beside("the camera beside it has no colour".into()))?;
        check_size(pictures, calibration)?;
        let fps = sensor.fps.min(pictures.fps);
        let period_ns = 1e9 / if fps.is_finite() && fps >= 1.0 { fps } else { USUAL_FPS };
        sensor.color = Some(calibration.camera);
        sensor.color_from_depth = calibration.color_from_depth;
        let is_host_time = pictures.identity.clock == ClockDomain::HostUnix;
        let color = Feed::new(color, is_host_time, is_live);
        let nearest = Nearest::new((period_ns / 2.0) as i64);
        Ok(Self { depth, color, rig, nearest, failed: VecDeque::new(), depth_ended: false })
    }

    /// Takes the pictures that are here, or those that the oldest depth frame needs.
    fn take_pictures(&mut self) {
        while let Some(next) = self.color.next(self.nearest.wants_color()) {
            match next {
                Ok(Some((time_ns, picture))) => self.nearest.push_color(time_ns, picture),
                Ok(None) => self.nearest.end_color(),
                Err(error) => {
                    self.nearest.end_color();
                    self.failed.push_back(error);
                }
            }
        }
    }

    /// Takes the next depth frame; at the end and before an error, those that wait go on.
    fn take_depth(&mut self) {
        match self.depth.next_frame() {
            Ok(Some(frame)) => return self.nearest.push_depth(frame.host_time_ns, frame),
            Ok(None) => self.depth_ended = true,
            Err(error) => self.failed.push_back(error),
        }
        self.nearest.flush();
    }
}

fn check_size(pictures: &Sensor, calibration: &ColorCalibration) -> Result<(), WebcamError> {
    let (sent, calibrated) = (pictures.color.unwrap_or(pictures.depth), calibration.camera);
    if (sent.width, sent.height) == (calibrated.width, calibrated.height) {
        return Ok(());
    }
    Err(WebcamError::Beside(format!(
        "{} sends pictures of {}x{} but its calibration is of {}x{}; calibrate it at a size that it has",
        pictures.name, sent.width, sent.height, calibrated.width, calibrated.height
    )))
}

impl Source for ColorBeside {
    fn rig(&self) -> &Rig {
        &self.rig
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, CaptureError> {
        loop {
            self.take_pictures();
            if let Some((frame, color)) = self.nearest.pop() {
                return Ok(Some(Frame { color, ..frame }));
            }
            if let Some(error) = self.failed.pop_front() {
                return Err(error);
            }
            if self.depth_ended {
                return Ok(None);
            }
            self.take_depth();
        }
    }

    fn frame_count(&self) -> Option<u64> {
        self.depth.frame_count()
    }
}
