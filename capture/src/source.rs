//! The trait that live devices, replay and the synthetic sensor have in common.

use crate::{CaptureError, Frame, Rig};

/// A stream of frames in the order of their time.
pub trait Source: Send {
    /// The sensors that the frames come from.
    fn rig(&self) -> &Rig;

    /// The next frame, or `None` at the end (live devices: when they were stopped or unplugged).
    ///
    /// # Errors
    /// [`CaptureError`] where a frame cannot be read; the call after it may go on with the next frame.
    fn next_frame(&mut self) -> Result<Option<Frame>, CaptureError>;

    /// How many frames there will be, where that is known (recordings), for progress.
    fn frame_count(&self) -> Option<u64> {
        None
    }

    /// What is known to be missing besides frames between others, a sentence each (folders of images).
    fn remarks(&self) -> Vec<String> {
        Vec::new()
    }
}
