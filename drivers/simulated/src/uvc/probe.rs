//! Probe and commit (UVC 1.1 §4.3.1.1).

use super::{
    StreamShape, Wire,
    descriptors::{CLOCK, MICROFRAME},
};

/// Bytes of the control in UVC 1.1.
pub(super) const BYTES: usize = 34;
/// The longest header of a bulk payload.
const MAX_HEADER: u32 = 255;

/// The settings that a stream was asked for, or agreed to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Agreed {
    /// Positions of the format and the size.
    pub(super) format: usize,
    pub(super) size: usize,
    pub(super) fps: u32,
}

impl Agreed {
    /// The offer when nothing was asked for.
    pub(super) fn first(stream: &StreamShape) -> Self {
        let fps = stream.formats.first().and_then(|f| f.rates.first().copied()).unwrap_or(30);
        Self { format: 0, size: 0, fps }
    }

    /// The nearest offer to what a host asks for.
    pub(super) fn nearest(stream: &StreamShape, asked: &[u8]) -> Self {
        let byte = |i: usize| usize::from(asked.get(i).copied().unwrap_or(1));
        let format = byte(2).clamp(1, stream.formats.len().max(1)) - 1;
        let Some(shape) = stream.formats.get(format) else { return Self::first(stream) };
        let size = byte(3).clamp(1, shape.sizes.len().max(1)) - 1;
        let interval = asked.get(4..8).map_or(0, |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        let nearest = shape.rates.iter().copied().min_by_key(|rate| (10_000_000 / rate).abs_diff(interval));
        Self { format, size, fps: nearest.unwrap_or(30) }
    }

    /// Bytes of a picture.
    pub(super) fn picture_bytes(self, stream: &StreamShape) -> u32 {
        let Some(format) = stream.formats.get(self.format) else { return 0 };
        let (width, height) = format.sizes.get(self.size).copied().unwrap_or_default();
        u32::from(width) * u32::from(height) * u32::from(format.bits) / 8
    }

    /// The control as a host reads it.
    pub(super) fn bytes(self, stream: &StreamShape, wire: Wire) -> Vec<u8> {
        let size = self.picture_bytes(stream);
        let payload = if wire == Wire::Bulk { size + MAX_HEADER } else { MICROFRAME as u32 };
        let mut bytes = vec![0, 0, self.format as u8 + 1, self.size as u8 + 1];
        bytes.extend((10_000_000 / self.fps.max(1)).to_le_bytes());
        bytes.extend([0; 10]);
        bytes.extend([size, payload, CLOCK].map(u32::to_le_bytes).as_flattened());
        bytes.extend([0, 0, 0, 0]);
        bytes
    }
}
