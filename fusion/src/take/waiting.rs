//! Frames that wait, packed where they are many.

use std::sync::Arc;

use toile_capture::{DepthImage, Frame, depth_codec};

use crate::subject::SURVEY_FRAMES;

/// A frame that waits for the volume to be found.
pub(crate) struct Waiting {
    pub frame: Frame,
    packed: Vec<u8>,
}

impl Waiting {
    pub(crate) fn new(mut frame: Frame, pack: bool) -> Self {
        let packed = frame.depth.as_ref().filter(|_| pack).and_then(|d| depth_codec::encode(d).ok());
        if packed.is_some() {
            frame.depth = None;
        }
        Self { frame, packed: packed.unwrap_or_default() }
    }

    /// Device time and host time, nanoseconds.
    pub(crate) fn times(&self) -> (i64, i64) {
        (self.frame.device_time_ns, self.frame.host_time_ns)
    }

    pub(crate) fn has_depth(&self) -> bool {
        self.frame.depth.is_some() || !self.packed.is_empty()
    }

    /// The frame with its depth.
    pub(crate) fn unpacked(&self) -> Frame {
        let mut frame = self.frame.clone();
        if !self.packed.is_empty() {
            frame.depth = depth_codec::decode(&self.packed).ok().map(Arc::<DepthImage>::new);
        }
        frame
    }
}

/// Frames with depth spread over the take.
pub(crate) fn spread(frames: &[Waiting]) -> Vec<Frame> {
    let with_depth: Vec<&Waiting> = frames.iter().filter(|f| f.has_depth()).collect();
    let step = with_depth.len().div_ceil(SURVEY_FRAMES).max(1);
    with_depth.into_iter().step_by(step).map(Waiting::unpacked).collect()
}
