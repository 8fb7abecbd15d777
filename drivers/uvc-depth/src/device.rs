//! The camera as a source of frames.

use std::{path::Path, sync::Arc, time::SystemTime};

use toile_capture::{CaptureError, Frame, Rig, Sensor, Source};

use crate::{
    UvcDepthError, calibration, decode,
    stream::{Buffers, V4l2Buffers},
};

/// A UVC depth camera: depth only, intrinsics from a file.
pub struct UvcDepthCamera<B: Buffers> {
    buffers: B,
    rig: Rig,
    next_index: u64,
    last_sequence: Option<u32>,
}

impl UvcDepthCamera<V4l2Buffers> {
    /// Opens the camera at `node` (such as `/dev/video2`) with the intrinsics of `calibration_file`.
    ///
    /// # Errors
    /// [`UvcDepthError`] where the file or the node cannot be used.
    pub fn open(node: &Path, calibration_file: &Path) -> Result<Self, UvcDepthError> {
        let sensor = calibration::read(calibration_file)?;
        let buffers = V4l2Buffers::open(node, sensor.depth.width, sensor.depth.height)?;
        let given = buffers.layout();
        if (given.width, given.height) != (sensor.depth.width, sensor.depth.height) {
            return Err(UvcDepthError::Calibration {
                path: calibration_file.to_path_buf(),
                reason: format!(
                    "it describes {}x{} but the camera streams {}x{}",
                    sensor.depth.width, sensor.depth.height, given.width, given.height
                ),
            });
        }
        Ok(Self::new(buffers, sensor))
    }
}

impl<B: Buffers> UvcDepthCamera<B> {
    /// A camera over any stream of buffers.
    pub fn new(buffers: B, sensor: Sensor) -> Self {
        Self { buffers, rig: Rig { sensors: vec![sensor] }, next_index: 0, last_sequence: None }
    }

    fn device_error(&self, reason: String) -> CaptureError {
        CaptureError::Device { device: self.rig.sensors[0].name.clone(), reason }
    }
}

impl<B: Buffers> Source for UvcDepthCamera<B> {
    fn rig(&self) -> &Rig {
        &self.rig
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, CaptureError> {
        let Some(buffer) = self.buffers.next_buffer().map_err(|e| self.device_error(e.to_string()))? else {
            return Ok(None);
        };
        // The kernel's counter is 32 bits wide and wraps; the difference does not mind.
        let lost = self.last_sequence.map_or(0, |last| buffer.sequence.wrapping_sub(last).wrapping_sub(1));
        self.last_sequence = Some(buffer.sequence);
        let depth = decode::depth16(&buffer.bytes, self.buffers.layout())
            .map_err(|e| CaptureError::Frame { index: self.next_index, reason: e.to_string() })?;
        let frame = Frame {
            sensor: 0,
            index: self.next_index,
            device_frame: u64::from(buffer.sequence),
            lost_before: lost,
            device_time_ns: buffer.time_ns,
            host_time_ns: host_time_ns(),
            depth: Some(Arc::new(depth)),
            color: None,
        };
        self.next_index += 1;
        Ok(Some(frame))
    }
}

fn host_time_ns() -> i64 {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since.as_nanos()).unwrap_or(i64::MAX)
}

#[cfg(test)]
mod tests {
    use toile_capture::DeviceIdentity;
    use toile_geometry::{Rigid, camera::PinholeCamera};

    use super::*;
    use crate::{decode::Layout, stream::Buffer};

    struct Script(Vec<Buffer>);

    impl Buffers for Script {
        fn layout(&self) -> Layout {
            Layout { width: 2, height: 1, stride: 4 }
        }
        fn next_buffer(&mut self) -> std::io::Result<Option<Buffer>> {
            Ok((!self.0.is_empty()).then(|| self.0.remove(0)))
        }
    }

    fn sensor() -> Sensor {
        Sensor {
            name: "scripted".into(),
            identity: DeviceIdentity::default(),
            depth: PinholeCamera::ideal(2, 1, 1.0, 1.0, 0.5, 0.0),
            depth_scale: 0.001,
            color: None,
            color_from_depth: Rigid::identity(),
            rig_from_depth: Rigid::identity(),
            fps: 30.0,
        }
    }

    fn buffer(sequence: u32, bytes: &[u8]) -> Buffer {
        Buffer { bytes: bytes.to_vec(), sequence, time_ns: i64::from(sequence) * 33_000_000 }
    }

    #[test]
    fn losses_are_counted_across_the_wrap_and_the_end_is_clean() {
        let whole = [1, 0, 2, 0];
        let script = Script(vec![buffer(u32::MAX - 1, &whole), buffer(u32::MAX, &whole), buffer(2, &whole)]);
        let mut camera = UvcDepthCamera::new(script, sensor());
        let lost: Vec<u32> = std::iter::from_fn(|| camera.next_frame().unwrap()).map(|f| f.lost_before).collect();
        assert_eq!(lost, vec![0, 0, 2]);
    }

    #[test]
    fn a_short_buffer_is_an_error_and_the_next_one_goes_on() {
        let script = Script(vec![buffer(0, &[1, 0, 2]), buffer(1, &[1, 0, 2, 0])]);
        let mut camera = UvcDepthCamera::new(script, sensor());
        assert!(camera.next_frame().unwrap_err().to_string().contains("3 bytes"));
        let frame = camera.next_frame().unwrap().unwrap();
        assert_eq!(frame.depth.unwrap().values, vec![1, 2]);
    }
}
