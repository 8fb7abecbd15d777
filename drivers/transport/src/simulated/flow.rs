//! The state that the nodes of one simulated video stream share: buffers that wait, and the picture that is being assembled.

use std::collections::VecDeque;

use super::uvc::Assembler;
use crate::video::VideoBuffer;

/// The size of one bulk read (`UVC_MAX_PACKETS` of 512 bytes).
pub(super) const BULK_ROOM: usize = 16_384;
/// More than any picture has.
pub(super) const MAX_ROOM: usize = 1 << 26;

/// Shared by the nodes of one stream.
#[derive(Default)]
pub(crate) struct Flow {
    pub(super) assembler: Option<Assembler>,
    /// The bulk payload that is being read.
    pub(super) payload: Vec<u8>,
    pub(super) payload_size: usize,
    pub(super) pictures: VecDeque<VideoBuffer>,
    pub(super) metadata: VecDeque<VideoBuffer>,
    /// Buffers of each node; 0 where it is off.
    pub(super) room: [usize; 2],
    pub(super) is_whole: bool,
    pub(super) microframe: u64,
}

impl Flow {
    pub(super) fn take(&mut self, payload: &[u8], now_ns: i64) {
        let Some(assembler) = &mut self.assembler else { return };
        for sent in assembler.push(payload, now_ns) {
            // `uvcvideo` keeps damaged pictures to itself (its parameter `nodrop` is 0); their numbers are missing.
            if sent.is_damaged {
                continue;
            }
            let buffer = |bytes| VideoBuffer { bytes, sequence: sent.sequence, time_ns: sent.time_ns };
            if self.metadata.len() < self.room[1] {
                self.metadata.push_back(buffer(sent.metadata));
            }
            if self.pictures.len() < self.room[0] {
                self.pictures.push_back(buffer(sent.picture));
            }
        }
    }

    /// A bulk payload ends with a read that is not full, or at its agreed size.
    pub(super) fn take_bulk(&mut self, data: &[u8], now_ns: i64) {
        if self.payload.len() + data.len() > MAX_ROOM {
            self.payload.clear();
            return;
        }
        self.payload.extend(data);
        if data.len() < BULK_ROOM || self.payload.len() >= self.payload_size {
            let payload = std::mem::take(&mut self.payload);
            self.take(&payload, now_ns);
        }
    }

    pub(super) fn queue(&mut self, is_metadata: bool) -> &mut VecDeque<VideoBuffer> {
        if is_metadata { &mut self.metadata } else { &mut self.pictures }
    }
}
