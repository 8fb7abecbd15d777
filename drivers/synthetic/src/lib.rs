//! A thin capture device over the synthetic scene: it stands for a live camera, without hardware.
//!
//! ```no_run
//! use toile_capture::Source;
//! use toile_driver_synthetic::SyntheticDevice;
//! use toile_synthetic::SyntheticSettings;
//! let mut device = SyntheticDevice::open(&SyntheticSettings::default(), 0).expect("the defaults are in range");
//! while let Some(frame) = device.next_frame().expect("the virtual device does not fail") {
//!     assert!(frame.depth.is_some());
//! }
//! ```

use std::collections::BTreeSet;

use toile_capture::{CaptureError, Frame, Rig, Source};
use toile_synthetic::{Subject, SyntheticError, SyntheticSettings, Take};

/// A virtual camera before one take of a virtual subject. Frames are rendered when they are asked for.
#[derive(Debug)]
pub struct SyntheticDevice {
    take: Take,
    rig: Rig,
    next: usize,
    given: u64,
    dropped: BTreeSet<u64>,
    unplugged_at: Option<u64>,
}

impl SyntheticDevice {
    /// Puts the subject of `settings` on the disk for take `take`.
    ///
    /// # Errors
    /// [`SyntheticError`] where a setting is out of range or the subject has no such take.
    pub fn open(settings: &SyntheticSettings, take: usize) -> Result<Self, SyntheticError> {
        Ok(Self::before(Subject::new(settings)?.take(take)?))
    }

    /// A device before a scene that has been made already.
    pub fn before(take: Take) -> Self {
        let rig = take.rig();
        Self { take, rig, next: 0, given: 0, dropped: BTreeSet::new(), unplugged_at: None }
    }

    /// Loses the frames with these device numbers, as a busy bus does.
    pub fn dropping(mut self, frames: impl IntoIterator<Item = u64>) -> Self {
        self.dropped = frames.into_iter().collect();
        self
    }

    /// Fails at the frame with this device number, as an unplugged cable does; the stream ends after that.
    pub fn unplugged_at(mut self, frame: u64) -> Self {
        self.unplugged_at = Some(frame);
        self
    }

    /// Serial number of the virtual device.
    pub fn serial(&self) -> &str {
        self.rig.sensors.first().map_or("", |s| &s.identity.serial)
    }

    /// The scene, with its truth.
    pub fn take(&self) -> &Take {
        &self.take
    }
}

impl Source for SyntheticDevice {
    fn rig(&self) -> &Rig {
        &self.rig
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, CaptureError> {
        let first = self.next;
        while self.dropped.contains(&(self.next as u64)) {
            self.next += 1;
        }
        let number = self.next as u64;
        if self.unplugged_at.is_some_and(|at| (first as u64..=number).contains(&at)) {
            self.next = self.take.moments.len();
            let reason = "the virtual cable was unplugged; plug it in and open the device again".to_string();
            return Err(CaptureError::Device { device: self.serial().to_string(), reason });
        }
        if self.next >= self.take.moments.len() {
            return Ok(None);
        }
        let mut frame =
            self.take.frame(self.next).map_err(|e| CaptureError::Frame { index: self.given, reason: e.to_string() })?;
        frame.index = self.given;
        frame.lost_before = (self.next - first) as u32;
        self.next += 1;
        self.given += 1;
        Ok(Some(frame))
    }

    fn frame_count(&self) -> Option<u64> {
        let frames = self.take.moments.len() as u64;
        Some(frames - self.dropped.range(..frames).count() as u64)
    }
}
