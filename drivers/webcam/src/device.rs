//! One webcam as a source of colour.

use nokhwa::{
    Buffer, Camera, NokhwaError,
    pixel_format::RgbFormat,
    utils::{ApiBackend, CameraFormat, CameraIndex, FrameFormat, RequestedFormat, RequestedFormatType, Resolution},
};
use toile_capture::{CaptureError, ClockDomain, DeviceIdentity, Frame, Rig, Sensor, Source, host_now_ns};
use toile_geometry::{Rigid, camera::PinholeCamera};

use crate::{WebcamError, convert};

/// Horizontal field of view assumed for an uncalibrated webcam, radians (60°, the usual for laptop cameras).
const ASSUMED_FIELD_OF_VIEW: f64 = std::f64::consts::FRAC_PI_3;

/// Names of the webcams, each with the index that opens it.
///
/// # Errors
/// [`WebcamError::Device`] where the system cannot list them.
pub fn list() -> Result<Vec<(u32, String)>, WebcamError> {
    let cameras = nokhwa::query(ApiBackend::Video4Linux)?;
    let mut named: Vec<(u32, String)> =
        cameras.iter().filter_map(|c| Some((c.index().as_index().ok()?, c.human_name()))).collect();
    named.sort();
    Ok(named)
}

/// A webcam that streams.
pub struct Webcam {
    camera: Camera,
    rig: Rig,
    next_index: u64,
}

impl Webcam {
    /// Opens webcam `index` and starts it: with pictures of `size` (columns and rows) where that is given, which a
    /// calibration holds for, else at its highest frame rate.
    ///
    /// # Errors
    /// [`WebcamError::Device`] where it cannot be opened or started, or has no pictures of that size.
    pub fn open(index: u32, size: Option<(u32, u32)>) -> Result<Self, WebcamError> {
        let mut camera = match size {
            Some(size) => with_size(index, size)?,
            None => with(index, RequestedFormatType::AbsoluteHighestFrameRate)?,
        };
        camera.open_stream()?;
        let (size, name) = (camera.resolution(), camera.info().human_name());
        let rig = Rig { sensors: vec![sensor(&name, size.width(), size.height(), camera.frame_rate())] };
        Ok(Self { camera, rig, next_index: 0 })
    }

    fn frame(&self, buffer: &Buffer) -> Result<Frame, WebcamError> {
        let now = host_now_ns();
        let size = buffer.resolution();
        let color = match buffer.source_frame_format() {
            FrameFormat::MJPEG => convert::jpeg(buffer.buffer())?,
            FrameFormat::YUYV => convert::yuyv(buffer.buffer(), size.width(), size.height())?,
            other => return Err(WebcamError::Format(other)),
        };
        Ok(Frame {
            sensor: 0,
            index: self.next_index,
            device_frame: self.next_index,
            lost_before: 0,
            device_time_ns: buffer.capture_timestamp().and_then(|t| i64::try_from(t.as_nanos()).ok()).unwrap_or(now),
            host_time_ns: now,
            depth: None,
            color: Some(color),
        })
    }
}

impl Source for Webcam {
    fn rig(&self) -> &Rig {
        &self.rig
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, CaptureError> {
        let index = self.next_index;
        let taken = self.camera.frame().map_err(WebcamError::from).and_then(|buffer| self.frame(&buffer));
        let frame = taken.map_err(|error| match error {
            WebcamError::Pixels(reason) => CaptureError::Frame { index, reason },
            error => CaptureError::Device { device: self.rig.sensors[0].name.clone(), reason: error.to_string() },
        })?;
        self.next_index += 1;
        Ok(Some(frame))
    }
}

/// The frame rate that is asked for with a size; the nearest one on offer is taken.
const USUAL_FPS: u32 = 30;

/// Opens a webcam for pictures of a size: JPEG, which takes up less of the bus, else YUYV.
fn with_size(index: u32, (width, height): (u32, u32)) -> Result<Camera, NokhwaError> {
    let format = |kind| CameraFormat::new(Resolution::new(width, height), kind, USUAL_FPS);
    let closest = |kind| with(index, RequestedFormatType::Closest(format(kind)));
    closest(FrameFormat::MJPEG).or_else(|_| closest(FrameFormat::YUYV))
}

fn with(index: u32, wanted: RequestedFormatType) -> Result<Camera, NokhwaError> {
    Camera::new(CameraIndex::Index(index), RequestedFormat::new::<RgbFormat>(wanted))
}

/// A sensor of colour alone. nokhwa gives no intrinsics: a 60° lens without distortion is assumed until a
/// calibration says better.
fn sensor(name: &str, width: u32, height: u32, fps: u32) -> Sensor {
    let f = f64::from(width) / 2.0 / (ASSUMED_FIELD_OF_VIEW / 2.0).tan();
    let camera =
        PinholeCamera::ideal(width, height, f, f, (f64::from(width) - 1.0) / 2.0, (f64::from(height) - 1.0) / 2.0);
    Sensor {
        name: name.to_string(),
        // nokhwa turns the kernel's monotonic times into the wall clock's.
        identity: DeviceIdentity { model: name.to_string(), clock: ClockDomain::HostUnix, ..DeviceIdentity::default() },
        depth: camera,
        depth_scale: 0.001,
        color: Some(camera),
        color_from_depth: Rigid::identity(),
        rig_from_depth: Rigid::identity(),
        fps: f64::from(fps),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_uncalibrated_webcam_sees_sixty_degrees() {
        let camera = sensor("cam", 1280, 720, 30).depth;
        let left = camera.unproject(-0.5, 359.5, 1.0);
        assert!((left.x.atan2(left.z).to_degrees() + 30.0).abs() < 0.01);
    }

    #[test]
    fn listing_never_panics_and_a_missing_camera_says_what_to_check() {
        let _ = list();
        for size in [None, Some((640, 480))] {
            let error = Webcam::open(4242, size).err().map(|e| e.to_string());
            assert!(error.is_some_and(|e| e.contains("plugged in")));
        }
    }
}
